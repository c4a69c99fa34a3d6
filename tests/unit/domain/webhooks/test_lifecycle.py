"""What of a run's events is news to a dispatcher, once each and whatever was sent before."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.domain.drop.consent import ConsentState
from app.domain.drop.record import Certainty, DropOutcome
from app.domain.events import Event
from app.domain.events.run import RunAttachment, RunUploadProgress
from app.domain.run.attachment import Attachment
from app.domain.run.run import RunState
from app.domain.webhooks.lifecycle import Lifecycle
from app.domain.webhooks.message import messages_of
from tests.support.reasons import some
from tests.support.run_events import RunEvents, new_run


def types(events: list[Event]) -> list[str]:
    lifecycle = Lifecycle()
    return [notification.type.value for event in events for notification in lifecycle.take(event)]


def a_delivery() -> list[Event]:
    run_events = RunEvents(new_run())
    return [
        run_events.created(),
        run_events.changed(state=RunState.UPLOADING),
        run_events.event(RunUploadProgress(mission_type="mission", sent=1, total=2, attempt=1, percent=50.0)),
        run_events.changed(upload_percent=100.0),
        run_events.changed(state=RunState.UPLOADED),
        run_events.changed(state=RunState.STARTING),
        run_events.changed(state=RunState.FLYING),
        run_events.changed(item_id="drop", flown_item_ids=("takeoff",)),
        run_events.changed(state=RunState.AT_DROP),
        run_events.dropped("drop", DropOutcome.RELEASED),
        run_events.changed(state=RunState.FLYING),
        run_events.changed(state=RunState.LANDED),
        run_events.changed(state=RunState.COMPLETED),
    ]


def test_a_good_delivery_is_told_from_its_order_to_its_end() -> None:
    assert types(a_delivery()) == [
        "delivery.created",
        "delivery.ready",
        "delivery.departed",
        "delivery.arrived",
        "drop.released",
        "delivery.landed",
        "delivery.completed",
    ]


def test_a_pause_is_told_with_its_end_and_a_landing_on_the_way_with_the_next_departure() -> None:
    run_events = RunEvents(new_run(state=RunState.STARTING))
    states = (RunState.FLYING, RunState.PAUSED, RunState.FLYING, RunState.LANDED, RunState.FLYING, RunState.RETURNING)
    told = types([run_events.created(), *(run_events.changed(state=state) for state in states)])
    assert told == [
        *("delivery.departed", "delivery.paused", "delivery.resumed"),
        *("delivery.landed", "delivery.departed", "delivery.returning"),
    ]


def test_an_outcome_that_became_surer_is_told_again_and_one_that_stayed_is_not() -> None:
    run_events = RunEvents(new_run("a", "b"))
    told = types(
        [
            run_events.created(),
            run_events.dropped("a", DropOutcome.UNKNOWN, Certainty.NONE),
            run_events.dropped("a", DropOutcome.UNKNOWN, Certainty.NONE),
            run_events.dropped("b", DropOutcome.KEPT),
            run_events.dropped("a", DropOutcome.RELEASED, Certainty.SENSED),
        ]
    )
    assert told == ["delivery.created", "drop.unknown", "drop.kept", "drop.released"]


def test_a_run_told_whole_after_events_were_left_out_tells_all_that_is_new_in_it() -> None:
    run_events = RunEvents(new_run("a", "b"))
    created = run_events.created()
    for name in ("a", "b"):
        run_events.dropped(name, DropOutcome.KEPT)
    whole = run_events.changed(state=RunState.ABORTED, reason=some("called back"))
    lifecycle = Lifecycle()
    lifecycle.take(created)
    messages = messages_of(whole, lifecycle.take(whole), "order-7")
    assert [message.type.value for message in messages] == ["drop.kept", "drop.kept", "delivery.aborted"]
    position = f"gw-1:4:{whole.hash[:12]}"
    assert [message.id for message in messages] == [position, f"{position}.1", f"{position}.2"]
    assert {message.run.order_id for message in messages if message.run} == {"order-7"}


def test_each_question_for_consent_is_told_once() -> None:
    run_events = RunEvents(new_run())
    events = [
        run_events.created(),
        run_events.asked("drop", 0, ConsentState.PENDING),
        run_events.asked("drop", 1),
        run_events.asked("drop", 1),
        run_events.changed(reason=some("waits")),
        run_events.asked("drop", 1, ConsentState.WITHDRAWN),
        run_events.asked("drop", 2),
        run_events.asked("drop", 2, ConsentState.GRANTED),
    ]
    assert types(events) == ["delivery.created", "drop.consent_asked", "drop.consent_asked"]


def test_an_attachment_is_news_of_its_drop() -> None:
    run_events = RunEvents(new_run())
    photo = Attachment(
        plan_item_id="drop", name="a.jpg", media_type="image/jpeg", size_bytes=5, sha256="ab" * 32, at=3.0, actor="desk"
    )
    event = run_events.event(RunAttachment(photo))
    assert types([run_events.created(), event]) == ["delivery.created", "drop.attachment"]


@given(st.integers(0, 12))
def test_who_begins_anew_in_the_middle_tells_the_rest_as_it_would_have_been_told(place: int) -> None:
    events = a_delivery()
    anew = Lifecycle()
    for event in events[:place]:
        anew.take(event)
    rest = [notification.type.value for event in events[place:] for notification in anew.take(event)]
    assert rest == types(events)[len(types(events)) - len(rest) :]
    assert types(events[:place]) + rest == types(events)
