"""An envelope follows from the newest event that is known, link by link, or is refused."""

from __future__ import annotations

import json

import pytest

from app.domain.cluster.envelope import (
    BrokenChainError,
    Envelope,
    EnvelopeVersionError,
    MissingEventsError,
    RelayedEvent,
    new_events,
    site_of,
)
from app.domain.cluster.site import SITE
from app.domain.errors import InvalidInputError
from app.domain.events.event import GENESIS, JournalHead, event_hash


def chain(count: int, *, kind: str = "vehicle.rebooted") -> tuple[RelayedEvent, ...]:
    events: list[RelayedEvent] = []
    for seq in range(1, count + 1):
        fields = {"kind": kind, "version": 1, "time": 5.5, "vehicle_id": "north-v1", "run_id": None, "data": "{}"}
        previous = events[-1].hash if events else GENESIS
        link = event_hash(previous, gateway="gw-1", seq=seq, **fields)  # type: ignore[arg-type]
        events.append(RelayedEvent(seq=seq, hash=link, **fields))  # type: ignore[arg-type]
    return tuple(events)


def envelope(*events: RelayedEvent) -> Envelope:
    return Envelope(site="north", gateway="gw-1", as_of=9, events=events)


def test_a_message_is_read_as_it_was_written_also_of_a_kind_that_is_not_known() -> None:
    sent = envelope(*chain(2, kind="vehicle.teleported"))
    assert Envelope.from_json(sent.to_json()) == sent
    assert len(new_events(JournalHead(), sent)) == 2


def test_only_what_is_new_is_given() -> None:
    events = chain(4)
    head = JournalHead(seq=2, hash=events[1].hash)
    assert new_events(head, envelope(*events)) == list(events[2:])
    assert new_events(head, envelope(*events[:2])) == []
    assert new_events(head, envelope()) == []


def test_a_gap_is_told() -> None:
    events = chain(4)
    with pytest.raises(MissingEventsError, match="events 1 to 2 of gw-1 are missing"):
        new_events(JournalHead(), envelope(*events[2:]))


@pytest.mark.parametrize("changed", [{"data": '{"a":1}'}, {"time": 5.6}, {"hash": "0" * 64}, {"kind": "x"}])
def test_an_event_that_was_altered_is_refused(changed: dict[str, object]) -> None:
    events = chain(3)
    altered = events[1].model_copy(update=changed)
    with pytest.raises(BrokenChainError, match=r"event [23] of gw-1") as caught:
        new_events(JournalHead(), envelope(events[0], altered, events[2]))
    assert caught.value.extra["gateway"] == "gw-1"


def test_an_event_that_was_removed_or_is_of_another_journal_is_refused() -> None:
    events = chain(3)
    with pytest.raises(BrokenChainError):
        new_events(JournalHead(), envelope(events[0], events[2]))
    with pytest.raises(BrokenChainError):
        new_events(JournalHead(seq=1, hash="f" * 64), envelope(*events))


def test_the_envelope_of_a_newer_version_waits_for_an_upgrade() -> None:
    message = json.loads(envelope().to_json()) | {"version": 2, "new": True}
    with pytest.raises(EnvelopeVersionError, match="version 2"):
        Envelope.from_json(json.dumps(message).encode())
    with pytest.raises(InvalidInputError, match="not an envelope"):
        Envelope.from_json(b"{}")


def test_the_same_events_have_the_same_message_id() -> None:
    events = chain(3)
    assert envelope(*events).message_id == "gw-1:1-3"
    assert envelope(*events[1:]).message_id == "gw-1:2-3"


def test_a_vehicle_s_id_names_its_site() -> None:
    assert site_of("north-v1") == site_of("north-v1-2") == "north"
    assert SITE.fullmatch("north2")
    assert not any(SITE.fullmatch(name) for name in ("", "North", "2north", "a-b", "a.b", "n" * 40))
