"""A run's record is of what the vehicle did, and not of the order in which its messages are handled."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.reasons import describe
from app.domain.run.run import RunState
from app.domain.vehicle.facts import ItemReached, MissionCurrent
from app.domain.vehicle.state import FlightMode
from tests.support.changed_flight import fly
from tests.support.run_service import RunService, run_service


def without_drop(plan: dict[str, Any]) -> None:
    plan["items"] = [item for item in plan["items"] if item["id"] != "drop"]


async def looked_at(service: RunService) -> None:
    """The run has looked at the vehicle, as it is now."""
    before = service.vehicle.looks
    await service.until(lambda: service.vehicle.looks > before + 3, "the vehicle must be looked at")


async def test_a_return_that_is_reached_before_it_is_shown_as_current_is_flown_once() -> None:
    """MISSION_CURRENT may show the item before it for a second."""
    async with run_service("multicopter-loop.json", changes=without_drop) as service:
        await fly(service, "door")
        seq = service.mission.seqs_of("home")[0]
        service.vehicle.put(ItemReached(seq))
        await service.until(lambda: service.run.item_id == "home", "it flies home")
        await looked_at(service)
        assert service.run.item_id == "home", "it does not seem to fly back"
        service.vehicle.put(mission_seq=seq)
        service.vehicle.touch_down(complete=True, last_seq=seq)
        await service.until_state(RunState.COMPLETED)
        assert service.run.flown_item_ids[-2:] == ("door", "home")
        assert service.run.flown_item_ids.count("home") == 1


async def test_a_lap_that_is_handled_in_one_go_is_counted() -> None:
    """On a busy machine many facts wait; the state tells only the last."""
    async with run_service("multicopter-loop.json", changes=without_drop) as service:
        await fly(service, "west")
        west, east, door = (service.mission.seqs_of(item_id)[0] for item_id in ("west", "east", "door"))
        told = [
            MissionCurrent(seq, FlightMode.MISSION, service.vehicle.truth.mission_id)
            for seq in (east, west, east, door)
        ]
        service.vehicle.put(*told, mission_seq=door)
        await service.until(lambda: service.run.item_id == "door", "it flies to the door")
        assert service.run.flown_item_ids == ("takeoff", "west", "east", "west", "east")


async def test_what_was_told_in_mission_mode_counts_although_another_mode_has_followed() -> None:
    async with run_service() as service:
        await fly(service, "corner")
        service.vehicle.put(ItemReached(service.mission.seqs_of("corner")[0], FlightMode.MISSION), mode=FlightMode.HOLD)
        await service.until_state(RunState.PAUSED)
        assert service.run.flown_item_ids == ("takeoff", "corner")


async def test_what_was_told_before_in_another_mode_does_not_count_in_mission_mode() -> None:
    async with run_service() as service:
        await fly(service, "takeoff")
        service.vehicle.put(ItemReached(service.mission.seqs_of("corner")[0], FlightMode.LAND))
        await looked_at(service)
        assert service.run.flown_item_ids == ()


async def test_a_return_whose_mode_is_seen_first_is_the_plan_s_own_although_its_reached_is_lost() -> None:
    async with run_service("multicopter-loop.json", changes=without_drop) as service:
        await fly(service, "door")
        seq = service.mission.seqs_of("home")[0]
        service.vehicle.put(mode=FlightMode.RETURN)
        await service.until_state(RunState.RETURNING)
        assert service.run.reason is None, "nobody is named before the item of the return has had time to come"
        service.vehicle.put(mission_seq=seq)
        await service.until(lambda: service.run.item_id == "home", "it flies home")
        service.vehicle.touch_down(complete=True, last_seq=seq)
        await service.until_state(RunState.COMPLETED)
        assert service.run.flown_item_ids[-2:] == ("door", "home")


@pytest.mark.parametrize(("asked", "mode"), [("pause", FlightMode.HOLD), ("return", FlightMode.RETURN)])
async def test_what_was_asked_explains_one_obedience_only(asked: str, mode: FlightMode) -> None:
    """Its pilot flies the mission on; what comes then is not as asked."""
    async with run_service() as service:
        await fly(service, "corner")
        await (service.runs.pause if asked == "pause" else service.runs.return_to_launch)(service.run_id)
        await service.until(lambda: "by command" in describe(service.run.reason), "it obeys")
        service.vehicle.put(mode=FlightMode.MISSION)
        await service.until(lambda: service.run.commanded is None, "what was asked is over")
        service.vehicle.put(mode=mode)
        await service.until(lambda: "another client or pilot" in describe(service.run.reason), "nobody asked for this")


async def test_a_mission_that_is_flown_on_by_its_pilot_after_a_return_that_was_asked_for_is_completed() -> None:
    async with run_service("multicopter-loop.json", changes=without_drop) as service:
        await fly(service, "door")
        await service.runs.return_to_launch(service.run_id)
        await service.until_state(RunState.RETURNING)
        service.vehicle.put(mode=FlightMode.MISSION)
        await service.until(lambda: service.run.commanded is None, "what was asked is over")
        seq = service.mission.seqs_of("home")[0]
        service.vehicle.put(mission_seq=seq)
        service.vehicle.touch_down(complete=True, last_seq=seq)
        await service.until(lambda: service.run.is_over, "it ends")
        assert (service.run.state, service.run.reason) == (RunState.COMPLETED, None)
