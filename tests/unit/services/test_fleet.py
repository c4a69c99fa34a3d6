"""Every vehicle has one id, and what happens to it is told once, in order."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass
from typing import Any

import pytest

from app.domain.errors import ConflictError, NotFoundError, VehicleQuarantinedError, VehicleRefusedError
from app.domain.events import EventKind
from app.domain.events.vehicle import VehicleLinkRestored, VehicleStatusText
from app.domain.ports.vehicle_link import Unsubscribe, VehicleLink
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.facts import (
    DuplicateSystem,
    LinkLost,
    LinkRestored,
    QuarantineEnded,
    SentInQuarantine,
    StatusText,
)
from app.domain.vehicle.state import FlightMode, LandedState
from app.services.clock import SystemClock
from app.services.fleet import EventBacklog, Fleet
from app.services.journal import Journal
from app.services.vehicle_commands import VehicleCommands
from tests.support.events import data_of
from tests.support.fakes import MemoryEventStore
from tests.support.scripted_link import ScriptedVehicle

TWICE = DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS))


class Source:
    """Finds the vehicles that the test puts in."""

    def __init__(self) -> None:
        self.listener: Callable[[VehicleLink], None] = lambda link: None

    def links(self) -> Sequence[VehicleLink]:
        return []

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        self.listener = listener
        return lambda: None

    async def start(self) -> None:
        return

    async def close(self) -> None:
        return


@contextlib.asynccontextmanager
async def fleet_of(*vehicles: ScriptedVehicle) -> AsyncIterator[tuple[Fleet, MemoryEventStore, Journal]]:
    events = MemoryEventStore()
    journal = Journal(events, SystemClock())
    await journal.start()
    source = Source()
    fleet = Fleet(source, journal)
    await fleet.start()
    for vehicle in vehicles:
        source.listener(vehicle)
    try:
        yield fleet, events, journal
    finally:
        await fleet.close()
        await journal.close()


async def test_two_vehicles_with_one_system_id_get_two_ids() -> None:
    async with fleet_of(ScriptedVehicle(), ScriptedVehicle()) as (fleet, _, _journal):
        assert [v.id for v in fleet.vehicles()] == ["v1", "v1-2"]


async def test_a_vehicle_told_twice_is_one_vehicle() -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle, vehicle) as (fleet, _, _journal):
        assert len(fleet.vehicles()) == 1


async def test_facts_become_events_in_order() -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (_, events, _journal):
        vehicle.put(LinkLost(3.1), LinkRestored(), StatusText("critical", "Low battery"))
    kinds = [event.kind for event in events.events]
    assert kinds == [
        EventKind.VEHICLE_SEEN,
        EventKind.VEHICLE_LINK_LOST,
        EventKind.VEHICLE_LINK_RESTORED,
        EventKind.VEHICLE_STATUS_TEXT,
    ]
    text = {"severity": "critical", "text": "Low battery", "repeated": 0, "last_age_s": None}
    assert data_of(events.events[-1]) == text


@pytest.mark.parametrize(
    "state", [{"armed": True}, {"landed": LandedState.IN_AIR}, {"in_failsafe": True, "mode": FlightMode.RETURN}]
)
async def test_how_a_vehicle_is_found_is_told_unless_it_is_at_rest(state: dict[str, Any]) -> None:
    vehicle, at_rest = ScriptedVehicle(), ScriptedVehicle()
    vehicle.put(**state)
    async with fleet_of(at_rest, vehicle) as (_, events, _journal):
        pass
    told = [(event.kind, event.vehicle_id) for event in events.events]
    seen = EventKind.VEHICLE_SEEN
    assert told == [(seen, "v1"), (seen, "v1-2"), (EventKind.VEHICLE_CHANGED, "v1-2")]
    assert data_of(events.events[-1]).items() >= state.items()


async def test_a_quarantined_vehicle_is_shown_and_not_commanded() -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (fleet, events, _journal):
        vehicle.put(TWICE, TWICE)
        assert fleet.view("v1").quarantined == TWICE.reason
        with pytest.raises(VehicleQuarantinedError):
            fleet.link("v1")
    assert [e.kind for e in events.events].count(EventKind.VEHICLE_QUARANTINED) == 1


async def test_a_quarantined_vehicle_still_gets_hold_return_and_land() -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (fleet, _, journal):
        vehicle.put(TWICE, armed=True, mode=FlightMode.MISSION)
        commands = VehicleCommands(fleet, journal)
        for command in (commands.hold, commands.return_to_launch, commands.land):
            await command("v1", "anna")
    assert vehicle.sent == ["hold", "return", "land"]


async def test_what_is_sent_to_a_quarantined_vehicle_is_an_event() -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (_, events, _journal):
        vehicle.put(TWICE, SentInQuarantine(FlightMode.RETURN))
    told = [data_of(e) for e in events.events if e.kind is EventKind.VEHICLE_COMMANDED_IN_QUARANTINE]
    assert told == [{"mode": "return"}]


@pytest.mark.parametrize("actor", [None, "anna"])
async def test_after_its_quarantine_a_vehicle_is_commanded_again(actor: str | None) -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (fleet, events, _journal):
        vehicle.put(TWICE, QuarantineEnded(actor))
        assert fleet.view("v1").quarantined is None
        assert fleet.link("v1") is vehicle
    told = [data_of(e) for e in events.events if e.kind is EventKind.VEHICLE_QUARANTINE_ENDED]
    assert told == [{"actor": actor}]


async def test_an_unknown_vehicle_is_named_with_those_that_are_known() -> None:
    async with fleet_of(ScriptedVehicle()) as (fleet, _, _journal):
        with pytest.raises(NotFoundError) as caught:
            fleet.view("v7")
        assert "v1" in caught.value.hint


@dataclass
class ToldFirst:
    """Offboard control that notes when it is told of a command."""

    vehicle: ScriptedVehicle

    def view_if_used(self) -> None:
        """Nobody has a lease."""

    def commanded(self, action: str) -> None:
        self.vehicle.sent.append(f"offboard control learns: {action}")


async def test_commands_outside_a_run_are_recorded_with_who_gave_them() -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (fleet, events, journal):
        commands = VehicleCommands(fleet, journal)
        with pytest.raises(ConflictError, match="not armed"):
            await commands.land("v1", "anna")
        vehicle.put(armed=True, mode=FlightMode.MISSION)
        fleet.vehicle("v1").observe(ToldFirst(vehicle))
        await commands.hold("v1", "anna")
        assert vehicle.sent == ["offboard control learns: hold", "hold"]
        fleet.vehicle("v1").own("run-1")
        with pytest.raises(ConflictError, match="run-1"):
            await commands.land("v1", "anna")
    told = [data_of(e) for e in events.events if e.kind is EventKind.VEHICLE_COMMAND]
    assert [d["outcome"] for d in told] == ["sent", "done"]
    assert {d["actor"] for d in told} == {"anna"}


async def test_a_command_outside_a_run_does_not_wait_for_a_disk_that_stalls() -> None:
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (fleet, events, journal):
        vehicle.put(armed=True, mode=FlightMode.HOLD)
        events.pause()
        order = asyncio.create_task(VehicleCommands(fleet, journal).land("v1", "anna"))
        try:
            async with asyncio.timeout(10):
                while not vehicle.sent:
                    await asyncio.sleep(0.01)
            assert not order.done(), "an answer says that it is stored"
        finally:
            events.open.set()
            await order
    assert [data_of(e)["outcome"] for e in events.events if e.kind is EventKind.VEHICLE_COMMAND] == ["sent", "done"]


async def test_a_refused_command_is_recorded_as_refused() -> None:
    vehicle = ScriptedVehicle()

    async def refuse() -> None:
        raise VehicleRefusedError("DENIED")

    async with fleet_of(vehicle) as (fleet, events, journal):
        vehicle.put(armed=True)
        vehicle.land = refuse  # type: ignore[method-assign]
        with pytest.raises(VehicleRefusedError):
            await VehicleCommands(fleet, journal).land("v1", "anna")
    assert [data_of(e)["outcome"] for e in events.events if e.kind is EventKind.VEHICLE_COMMAND] == ["sent", "failed"]


async def test_texts_never_take_the_place_of_link_and_mode_events() -> None:
    """45,010 texts in 20 s had pushed 4,652 other events out."""
    vehicle = ScriptedVehicle()
    async with fleet_of(vehicle) as (_, events, _journal):
        for number in range(45_010):
            vehicle.put(StatusText("info", f"text {number}"))
            if number % 10 == 0:
                vehicle.put(LinkLost(3.1) if number % 20 else LinkRestored())
            if number % 1000 == 0:
                await asyncio.sleep(0)
    kinds = [event.kind for event in events.events]
    links = [kind for kind in kinds if kind in (EventKind.VEHICLE_LINK_LOST, EventKind.VEHICLE_LINK_RESTORED)]
    assert len(links) == 4_501
    assert kinds.count(EventKind.VEHICLE_STATUS_TEXT) < 45_010


async def test_a_backlog_keeps_its_order_and_counts_what_finds_no_place() -> None:
    journal = Journal(MemoryEventStore(), SystemClock())
    backlog = EventBacklog(most=3, most_texts=2)
    text = journal.new_event(VehicleStatusText(severity="info", text="noise"))
    link = journal.new_event(VehicleLinkRestored())
    places = [backlog.put(event, is_text=event is text) for event in (text, link, text, text, link, link, link)]
    assert places == [True, True, True, False, True, True, False]
    assert backlog.lost == {False: 1, True: 1}
    assert await backlog.take(10) == [text, link, text, link, link]
    backlog.done(1)
    assert backlog.put(text, is_text=True), "a text that is recorded makes room for another"
    backlog.done(5)
    async with asyncio.timeout(1.0):
        await backlog.drained()
