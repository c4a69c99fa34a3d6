"""What speaks against a vehicle in the wind of a job, and whether waiting alone may mend it."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any, cast

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.jobs.assignment import VehicleReadiness, hopeless
from app.domain.jobs.job import Candidate, VehicleSelector
from app.domain.plan import Plan, parse_plan
from app.domain.plan.walk import reference_home
from app.domain.prediction import CALM, Wind, predict
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.performance import Performance
from app.domain.vehicle.state import LandedState, VehicleProfile, VehicleState, VehicleType
from app.services.fleet import Fleet
from app.services.jobs.assessment import Assessment
from app.services.plan_work import PlanWork
from tests.support.paths import PLANS

STRONG = Wind(north_m_s=8.0)
READY = VehicleState(connected=True, armed=False, landed=LandedState.ON_GROUND, battery_percent=100.0)


class OneWing:
    """The fleet, as far as an assessment asks it."""

    def __init__(self, facts: VehicleProfile) -> None:
        self.told = facts

    async def facts(self, _vehicle_id: str) -> VehicleProfile:
        return self.told


def wing_plan() -> Plan:
    document: dict[str, Any] = json.loads((PLANS / "fixed-wing-pass.json").read_text())
    return parse_plan(document)


def wing(plan: Plan, **changes: Any) -> VehicleProfile:
    """A wing at the plan's home whose full battery lasts for the plan in calm air, and for little more."""
    facts = replace(default_facts(VehicleType.FIXED_WING), home=reference_home(plan, None), battery_percent=100.0)
    minutes = predict(plan, facts, CALM).duration_s / 60.0
    lasts = Performance(battery_percent_per_min=75.0 / minutes, reserve_percent=20.0)
    return replace(facts, performance=lasts, **changes)


async def look(facts: VehicleProfile, plan: Plan, wind: Wind = CALM, **sight: Any) -> Candidate:
    seen = VehicleReadiness(vehicle_id="v1", state=READY, **sight)
    (candidate,) = await assess(facts, plan, wind, seen)
    return candidate


async def assess(facts: VehicleProfile, plan: Plan, wind: Wind, *sights: VehicleReadiness) -> tuple[Candidate, ...]:
    assessment = Assessment(cast(Fleet, OneWing(facts)), facts_s=10.0, work=PlanWork())
    return await assessment.candidates(plan, VehicleSelector(vehicle="any"), sights, wind)


def codes(candidate: Candidate) -> set[str]:
    return {refusal.code for refusal in candidate.refusals}


async def test_a_battery_that_lasts_in_calm_air_is_refused_for_the_wind_and_waiting_mends_nothing() -> None:
    plan = wing_plan()
    calm, windy = await look(wing(plan), plan), await look(wing(plan), plan, STRONG)
    assert codes(calm) == set()
    assert "battery.reserve_at_home" in codes(windy)
    assert windy.permanent, "it began with a full one"
    assert "v1: " in hopeless([windy])


@pytest.mark.parametrize(
    ("named", "refused"), [((), {"vehicle.unsigned"}), (("v1", "v2"), set())], ids=["any", "any of these"]
)
async def test_a_job_for_any_vehicle_goes_to_none_that_may_be_forged(named: tuple[str, ...], refused: set[str]) -> None:
    plan = wing_plan()
    signed, pinned = (
        VehicleReadiness(vehicle_id=name, state=replace(READY, link_security=security))
        for name, security in (("v1", LinkSecurity.SIGNED), ("v2", LinkSecurity.PINNED))
    )
    assessment = Assessment(cast(Fleet, OneWing(wing(plan))), facts_s=10.0, work=PlanWork())
    selector = VehicleSelector(vehicle="any", allowed_vehicles=named)
    sure, doubtful = await assessment.candidates(plan, selector, (signed, pinned))
    assert (codes(sure), codes(doubtful)) == (set(), refused)
    alone = (await assessment.candidates(plan, VehicleSelector(vehicle="any"), (pinned,)))[0]
    assert codes(alone) == set(), "no vehicle signs"


async def test_the_same_assessment_tells_one_wind_from_another() -> None:
    plan = wing_plan()
    assessment = Assessment(cast(Fleet, OneWing(wing(plan))), facts_s=10.0, work=PlanWork())
    sight = VehicleReadiness(vehicle_id="v1", state=READY)
    told = [
        await assessment.candidates(plan, VehicleSelector(vehicle="any"), [sight], wind)
        for wind in (CALM, STRONG, CALM)
    ]
    assert [one.can for (one,) in told] == [True, False, True]


async def test_a_wing_that_does_not_get_on_against_the_wind_is_refused() -> None:
    plan = wing_plan()
    assert "wind.too_strong" in codes(await look(wing(plan), plan, Wind(north_m_s=60.0)))


async def test_a_low_battery_is_mended_by_charging_it() -> None:
    plan = wing_plan()
    low = await look(wing(plan, battery_percent=60.0), plan)
    assert "battery.reserve_at_home" in codes(low)
    assert not low.permanent
    assert hopeless([low]) == ""


async def test_another_type_is_for_ever_and_a_vehicle_that_is_busy_besides_is_not_the_reason() -> None:
    plan = wing_plan()
    other = await look(default_facts(VehicleType.ROVER), plan, held_by="run run-1")
    assert {"vehicle.busy", "vehicle.type_differs"} <= codes(other)
    assert other.permanent
    assert "rover" in hopeless([other])
    busy = await look(wing(plan), plan, held_by="run run-1")
    assert (codes(busy), busy.permanent) == ({"vehicle.busy"}, False)
    assert hopeless([other, busy]) == "", "the second may have it later"
    assert hopeless([]) == "", "nobody was seen yet"


@pytest.mark.parametrize("count", [5, 8])
def test_a_warning_names_a_few_vehicles(count: int) -> None:
    told = hopeless([Candidate(vehicle_id=f"v{number}", permanent=True) for number in range(count)])
    assert ("and 3 more" in told) == (count == 8)
    assert "v4: see its refusals" in told
