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
from tests.support.story_events import Teller, new_run


def types(events: list[Event]) -> list[str]:
    lifecycle = Lifecycle()
    return [news.type.value for event in events for news in lifecycle.take(event)]


def a_delivery() -> list[Event]:
    teller = Teller(new_run())
    return [
        teller.created(),
        teller.changed(state=RunState.UPLOADING),
        teller.event(RunUploadProgress(mission_type="mission", sent=1, total=2, attempt=1, percent=50.0)),
        teller.changed(upload_percent=100.0),
        teller.changed(state=RunState.UPLOADED),
        teller.changed(state=RunState.STARTING),
        teller.changed(state=RunState.FLYING),
        teller.changed(item_id="drop", flown_item_ids=("takeoff",)),
        teller.changed(state=RunState.AT_DROP),
        teller.dropped("drop", DropOutcome.RELEASED),
        teller.changed(state=RunState.FLYING),
        teller.changed(state=RunState.LANDED),
        teller.changed(state=RunState.COMPLETED),
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
    teller = Teller(new_run(state=RunState.STARTING))
    states = (RunState.FLYING, RunState.PAUSED, RunState.FLYING, RunState.LANDED, RunState.FLYING, RunState.RETURNING)
    told = types([teller.created(), *(teller.changed(state=state) for state in states)])
    assert told == [
        *("delivery.departed", "delivery.paused", "delivery.resumed"),
        *("delivery.landed", "delivery.departed", "delivery.returning"),
    ]


def test_an_outcome_that_became_surer_is_told_again_and_one_that_stayed_is_not() -> None:
    teller = Teller(new_run("a", "b"))
    told = types(
        [
            teller.created(),
            teller.dropped("a", DropOutcome.UNKNOWN, Certainty.NONE),
            teller.dropped("a", DropOutcome.UNKNOWN, Certainty.NONE),
            teller.dropped("b", DropOutcome.KEPT),
            teller.dropped("a", DropOutcome.RELEASED, Certainty.SENSED),
        ]
    )
    assert told == ["delivery.created", "drop.unknown", "drop.kept", "drop.released"]


def test_a_run_told_whole_after_events_were_left_out_tells_all_that_is_new_in_it() -> None:
    teller = Teller(new_run("a", "b"))
    created = teller.created()
    for name in ("a", "b"):
        teller.dropped(name, DropOutcome.KEPT)
    whole = teller.changed(state=RunState.ABORTED, reason=some("called back"))
    lifecycle = Lifecycle()
    lifecycle.take(created)
    messages = messages_of(whole, lifecycle.take(whole), "order-7")
    assert [message.type.value for message in messages] == ["drop.kept", "drop.kept", "delivery.aborted"]
    assert [message.id for message in messages] == ["gw-1:4", "gw-1:4.1", "gw-1:4.2"]
    assert {message.run.order_id for message in messages if message.run} == {"order-7"}


def test_each_question_for_consent_is_told_once() -> None:
    teller = Teller(new_run())
    events = [
        teller.created(),
        teller.asked("drop", 0, ConsentState.PENDING),
        teller.asked("drop", 1),
        teller.asked("drop", 1),
        teller.changed(reason=some("waits")),
        teller.asked("drop", 1, ConsentState.WITHDRAWN),
        teller.asked("drop", 2),
        teller.asked("drop", 2, ConsentState.GRANTED),
    ]
    assert types(events) == ["delivery.created", "drop.consent_asked", "drop.consent_asked"]


def test_an_attachment_is_news_of_its_drop() -> None:
    teller = Teller(new_run())
    photo = Attachment(
        plan_item_id="drop", name="a.jpg", media_type="image/jpeg", size_bytes=5, sha256="ab" * 32, at=3.0, actor="desk"
    )
    event = teller.event(RunAttachment(photo))
    assert types([teller.created(), event]) == ["delivery.created", "drop.attachment"]


@given(st.integers(0, 12))
def test_who_begins_anew_in_the_middle_tells_the_rest_as_it_would_have_been_told(place: int) -> None:
    events = a_delivery()
    anew = Lifecycle()
    for event in events[:place]:
        anew.take(event)
    rest = [news.type.value for event in events[place:] for news in anew.take(event)]
    assert rest == types(events)[len(types(events)) - len(rest) :]
    assert types(events[:place]) + rest == types(events)
