"""The return at a plan's end: PX4 says that it is reached when it begins, and a run says so of no place."""

from __future__ import annotations

from app.domain.events import EventKind
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode
from tests.support.changed_flight import fly
from tests.support.events import data_of
from tests.support.runs_fixture import desk


async def test_a_return_is_under_way_from_its_beginning_on_and_told_once() -> None:
    async with desk() as at:
        await fly(at, "clinic")
        seq = at.mission.seqs_of("home")[0]
        at.vehicle.put(ItemReached(seq), mode=FlightMode.RETURN, mission_seq=seq)
        await at.until(lambda: at.run.item_id == "home", "it flies home")
        at.vehicle.touch_down(complete=True, last_seq=seq)
        await at.until(lambda: at.run.is_over, "the run must end")
        told = [data_of(event) for event in at.events.events if event.kind is EventKind.RUN_ITEM]
        assert [one["phase"] for one in told if one["item_id"] == "home"] == ["current"]


async def test_a_waypoint_that_is_reached_is_told_so() -> None:
    async with desk() as at:
        await fly(at, "corner")
        at.vehicle.put(ItemReached(at.mission.seqs_of("corner")[0]))
        await at.until(lambda: "corner" in at.run.flown_item_ids, "it is flown")
        told = [data_of(event) for event in at.events.events if event.kind is EventKind.RUN_ITEM]
        assert [one["phase"] for one in told if one["item_id"] == "corner"] == ["current", "reached"]
