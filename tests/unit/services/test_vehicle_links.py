"""What the guards refuse becomes one event a minute and reason; keys are given to vehicles that stand still."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from app.domain.errors import ConflictError, LinkTimeoutError, NotFoundError
from app.domain.events import EventKind
from app.domain.vehicle.link_security import LinkSecurity, RefusalKind, Refused
from app.services.clock import SystemClock
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.vehicle_links import RECORD_EVERY_S, RefusalLog, VehicleLinks
from tests.support.fake_links import FakeLink
from tests.support.fakes import MemoryEventStore
from tests.support.known_guards import KnownGuards
from tests.support.known_links import KnownLinks
from tests.support.service_in_process import until

ONE, TWO = "udpin://0.0.0.0:14540", "udpin://0.0.0.0:14541"


class Time:
    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def other_peer(count: int, connection: str = ONE, *systems: int) -> Refused:
    return Refused(connection, RefusalKind.OTHER_PEER, count, "10.0.0.66:5000", systems or (1,))


def test_the_first_of_a_kind_is_told_at_once_and_the_rest_once_a_minute() -> None:
    time = Time()
    log = RefusalLog(time)
    told: list[int] = []
    for second in range(int(RECORD_EVERY_S) * 3):
        time.now_s += 1.0
        told += [event.count for event in log.take([other_peer(1 + second * 10)])]
    assert told == [1, 600, 600]


def test_each_reason_is_told_for_itself_and_all_connections_together() -> None:
    log = RefusalLog(Time())
    unsigned = Refused(ONE, RefusalKind.UNSIGNED, 4, "10.0.0.9:1", (7,))
    told = {event.refusal: event for event in log.take([other_peer(3), other_peer(5, TWO, 2, 3), unsigned])}
    assert told[RefusalKind.OTHER_PEER].count == 8
    assert told[RefusalKind.OTHER_PEER].connections == (ONE, TWO)
    assert told[RefusalKind.OTHER_PEER].systems == (1, 2, 3)
    assert told[RefusalKind.UNSIGNED].peer == "10.0.0.9:1"


@pytest.mark.parametrize("kind", [RefusalKind.NOT_ANNOUNCED, RefusalKind.GROUND_STATION, RefusalKind.DAMAGED])
def test_what_belongs_to_every_link_is_not_told(kind: RefusalKind) -> None:
    assert RefusalLog(Time()).take([Refused(ONE, kind, 1000, "10.0.0.2:1")]) == []


def test_what_did_not_grow_is_not_told_again() -> None:
    time = Time()
    log = RefusalLog(time)
    assert log.take([other_peer(3)])
    time.now_s += RECORD_EVERY_S * 2
    assert log.take([other_peer(3)]) == []


@asynccontextmanager
async def linked() -> AsyncIterator[tuple[VehicleLinks, KnownGuards, FakeLink, MemoryEventStore]]:
    events, guards, vehicle = MemoryEventStore(), KnownGuards(), FakeLink(1)
    journal = Journal(events, SystemClock())
    fleet = Fleet(KnownLinks(vehicle), journal)
    links = VehicleLinks(guards, fleet, journal)
    for part in (journal, fleet, links):
        await part.start()
    try:
        yield links, guards, vehicle, events
    finally:
        for part in (links, fleet, journal):
            await part.close()


def keys_told(events: MemoryEventStore) -> list[tuple[Any, Any, Any]]:
    kept = [event.data for event in events.events if event.kind is EventKind.VEHICLE_LINK_KEY]
    return [(data.actor, data.outcome, data.fingerprint) for data in kept]  # type: ignore[union-attr]


async def test_refusals_are_recorded() -> None:
    async with linked() as (_, guards, _, events):
        guards.refusals = [other_peer(12)]
        await until(lambda: any(event.kind is EventKind.LINK_REFUSED for event in events.events))


async def test_a_vehicle_is_given_its_key_and_who_did_it_is_recorded() -> None:
    async with linked() as (links, guards, _, events):
        guards.keys[1] = "abcd"
        found = await links.set_up_signing("v1", "boss")
        assert (found.vehicle_id, found.fingerprint, found.link_security) == ("v1", "abcd", LinkSecurity.SIGNED)
        assert keys_told(events) == [("boss", "sent", None), ("boss", "done", "abcd")]


async def test_a_vehicle_that_goes_on_unsigned_is_recorded_too() -> None:
    async with linked() as (links, guards, _, events):
        guards.refusal = LinkTimeoutError("system 1 does not sign")
        with pytest.raises(LinkTimeoutError):
            await links.set_up_signing("v1", "boss")
        assert [outcome for _, outcome, _ in keys_told(events)] == ["sent", "failed"]


async def test_a_vehicle_that_is_armed_or_not_there_is_left_alone() -> None:
    async with linked() as (links, guards, vehicle, events):
        guards.keys[1] = "abcd"
        vehicle.change(armed=True)
        with pytest.raises(ConflictError, match="armed"):
            await links.set_up_signing("v1", "boss")
        with pytest.raises(NotFoundError):
            await links.set_up_signing("v9", "boss")
        assert keys_told(events) == []
