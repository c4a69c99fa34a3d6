"""A change of plan is held to the vehicle as it is now: its charge, its load, and the wind of its run."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.errors import PlanRejectedError
from app.domain.events import EventKind
from app.domain.prediction import Wind
from app.domain.rules import check_plan
from app.domain.run.run import RunState
from app.domain.vehicle.performance import Performance
from app.domain.vehicle.state import LandedState, VehicleProfile
from tests.support.changed_flight import Document, clinic_moved, item, store
from tests.support.events import data_of
from tests.support.gated_plans import codes
from tests.support.run_service import RunService, run_service

DECLARED = Performance(battery_percent_per_min=10.0, reserve_percent=20.0, payload_max_kg=2.0)
WIND = Wind(north_m_s=3.0)


def too_heavy(document: Document) -> None:
    item(document, "drop")["mass_kg"] = 5.0


async def fly(service: RunService) -> None:
    """In the air with a full battery, on the way to the corner."""
    service.vehicle.put(battery_percent=95.0)
    service.run_id = (await service.runs.create("plan-1", "v1", start=True, actor="test", wind=WIND)).id
    await service.until_state(RunState.FLYING)
    service.vehicle.put(
        mission_seq=service.mission.seqs_of("corner")[0], landed=LandedState.IN_AIR, relative_altitude_m=15.0
    )
    await service.until(lambda: service.run.item_id == "corner", "progress must show")


async def test_a_change_that_the_charge_of_now_does_not_carry_home_is_refused() -> None:
    async with run_service(performance=DECLARED) as service:
        await fly(service)
        service.vehicle.put(battery_percent=21.0)
        with pytest.raises(PlanRejectedError) as refused:
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert "battery.reserve_at_home" in codes(refused.value)
        assert (service.run.changing, service.run.changes, service.vehicle.on_board) == (None, 0, service.mission.items)


async def test_only_what_is_left_to_fly_is_held_to_the_charge_of_now() -> None:
    async with run_service(performance=DECLARED) as service:
        await fly(service)
        service.vehicle.put(battery_percent=43.0)
        whole = check_plan(service.plan, await service.fleet.facts("v1"), WIND)
        assert "battery.reserve_at_drop" in {finding.code for finding in whole}, "too little for a start on the ground"
        await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert service.run.plan_id == "plan-2"


async def test_a_change_that_makes_the_load_too_heavy_is_refused() -> None:
    async with run_service(performance=DECLARED) as service:
        await fly(service)
        with pytest.raises(PlanRejectedError) as refused:
            await service.runs.change_mission(service.run_id, store(service, too_heavy), None, "ann")
        assert codes(refused.value) == {"payload.too_heavy"}


async def test_a_change_is_predicted_with_the_wind_of_its_run() -> None:
    async with run_service(performance=DECLARED) as service:
        await fly(service)
        await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        (told,) = [event for event in service.events.events if event.kind is EventKind.RUN_MISSION_CHANGED]
        changed = data_of(told)["timeline"]
        assert changed["wind"] == {"north_m_s": 3.0, "east_m_s": 0.0, "given": True}
        assert (changed["battery_start_percent"], changed["battery_used_percent"] > 0.0) == (95.0, True)


async def test_a_change_in_flight_is_checked_against_parameters_that_are_read_anew() -> None:
    async with run_service() as service:
        await fly(service)
        asked: list[bool] = []
        facts = service.vehicle.facts

        async def read_facts(*, fresh: bool = False) -> VehicleProfile:
            asked.append(fresh)
            return replace(facts, parameters={**facts.parameters, "MIS_TKO_LAND_REQ": 3}) if fresh else facts

        service.vehicle.read_facts = read_facts  # type: ignore[method-assign]
        with pytest.raises(PlanRejectedError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert asked == [True]
