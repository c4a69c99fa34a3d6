"""A run records what was predicted before it flies, and when each item began and ended."""

from __future__ import annotations

from typing import Any

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import DropOutcome
from app.domain.events import EventKind
from app.domain.events.run import RunItemEnded
from app.domain.flight.flight import ItemClock
from app.domain.flight.progress import MissionProgress
from app.domain.flight.snapshot import VehicleSnapshot
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.prediction import Timeline
from app.domain.vehicle.state import FlightMode, VehicleState, VehicleType
from app.services.delivery_reports import Comparisons
from tests.support.events import data_of
from tests.support.paths import PLANS
from tests.support.run_service import RunService, run_service


def told(service: RunService, kind: EventKind) -> list[dict[str, Any]]:
    return [data_of(event) for event in service.events.events if event.kind is kind]


async def flown_to_the_end(service: RunService) -> None:
    await service.create()
    await service.fly_to_drop()
    await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the parcel must be released")
    service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
    await service.until(lambda: service.run.is_over, "the run must end after the landing")


async def test_the_prediction_is_recorded_before_the_vehicle_is_touched() -> None:
    async with run_service() as service:
        await service.create(start=False)
        assert service.kinds()[:2] == ["run.created", "run.predicted"]
        (data,) = told(service, EventKind.RUN_PREDICTED)
        assert Timeline.model_validate(data).order == ("takeoff", "corner", "clinic", "drop", "home")


async def test_each_item_that_was_flown_is_told_once_in_order_and_without_holes() -> None:
    async with run_service() as service:
        await flown_to_the_end(service)
        ended = told(service, EventKind.RUN_ITEM_ENDED)
        assert [item["item_id"] for item in ended] == ["takeoff", "corner", "clinic", "drop", "home"]
        seen = [item for item in ended if None not in (item["began_s"], item["ended_s"])]
        assert all(item["began_s"] <= item["ended_s"] for item in seen)


def test_the_time_of_a_pause_is_told_with_the_item_in_which_it_was() -> None:
    plan = parse_plan((PLANS / "clinic-run.json").read_text())
    mission = compile_plan(plan, default_facts(VehicleType.MULTICOPTER))
    progress, clock = MissionProgress.of(mission).now_current(0), ItemClock.of(mission)
    noted: list[RunItemEnded] = []

    def look(boot_s: float, mode: FlightMode, *, is_paused: bool = False) -> None:
        nonlocal clock
        state = VehicleState(connected=True, mode=mode, boot_time_s=boot_s, position_age_s=0.0)
        seen = VehicleSnapshot(state, boot_s, boot_s, 1.0)
        clock, ended = clock.observe(seen, progress, (), was_airborne=True, is_paused=is_paused, is_just_back=False)
        noted.extend(ended)

    look(100.0, FlightMode.MISSION)
    for boot_s in (101.0, 102.0, 103.0):
        look(boot_s, FlightMode.HOLD, is_paused=True)
    look(104.0, FlightMode.MISSION)  # it goes on: when, since the look before, nobody saw
    progress = progress.now_current(1)
    look(105.5, FlightMode.MISSION)
    assert noted == [RunItemEnded(item_id="takeoff", began_s=100.0, ended_s=105.5, paused_s=3.0)]


def test_an_item_that_ends_as_the_link_is_just_back_ended_nobody_knows_when() -> None:
    """MISSION_CURRENT comes once a second: the first look after the loss may show what was current before."""
    plan = parse_plan((PLANS / "clinic-run.json").read_text())
    mission = compile_plan(plan, default_facts(VehicleType.MULTICOPTER))
    progress, clock = MissionProgress.of(mission).now_current(0), ItemClock.of(mission)
    noted: list[RunItemEnded] = []
    for boot_s, seq in ((100.0, 0), (140.0, 0), (140.7, 1)):
        progress = progress.now_current(seq)
        state = VehicleState(connected=True, mode=FlightMode.MISSION, boot_time_s=boot_s, position_age_s=0.0)
        seen = VehicleSnapshot(state, boot_s, boot_s, 1.0)
        clock, ended = clock.observe(
            seen, progress, (), was_airborne=True, is_paused=False, is_just_back=boot_s > 100.0
        )
        noted.extend(ended)
    assert [(item.item_id, item.ended_s) for item in noted] == [("takeoff", None)]


async def test_the_comparison_is_made_of_the_runs_own_events() -> None:
    async with run_service() as service:
        await flown_to_the_end(service)
        comparison = await Comparisons(service.runs, service.journal).of(service.run_id)
        assert [item.item_id for item in comparison.items] == ["takeoff", "corner", "clinic", "drop", "home"]
        assert all((item.flown_s is None) == (item.reason is not None) for item in comparison.items)
        (drop,) = comparison.drops
        assert drop.distance_m is not None
        assert comparison.reason is None
