"""The return at a plan's end: PX4 says that it is reached when it begins, and a run says so of no place."""

from __future__ import annotations

from app.domain.events import EventKind
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode
from tests.support.changed_flight import fly
from tests.support.events import data_of
from tests.support.run_service import run_service


async def test_a_return_is_under_way_from_its_beginning_on_and_told_once() -> None:
    async with run_service() as service:
        await fly(service, "clinic")
        seq = service.mission.seqs_of("home")[0]
        service.vehicle.put(ItemReached(seq), mode=FlightMode.RETURN, mission_seq=seq)
        await service.until(lambda: service.run.item_id == "home", "it flies home")
        service.vehicle.touch_down(complete=True, last_seq=seq)
        await service.until(lambda: service.run.is_over, "the run must end")
        told = [data_of(event) for event in service.events.events if event.kind is EventKind.RUN_ITEM]
        assert [one["phase"] for one in told if one["item_id"] == "home"] == ["current"]


async def test_a_waypoint_that_is_reached_is_told_so() -> None:
    async with run_service() as service:
        await fly(service, "corner")
        service.vehicle.put(ItemReached(service.mission.seqs_of("corner")[0]))
        await service.until(lambda: "corner" in service.run.flown_item_ids, "it is flown")
        told = [data_of(event) for event in service.events.events if event.kind is EventKind.RUN_ITEM]
        assert [one["phase"] for one in told if one["item_id"] == "corner"] == ["current", "reached"]
