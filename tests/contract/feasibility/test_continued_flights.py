"""What is left of a plan that is changed in flight: no drop that is over is in it, and the autopilot takes it."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.domain.errors import PlanRejectedError
from app.domain.items import Jump, Takeoff
from app.domain.mission import MavCmd
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.plan.drops import drops_of
from app.domain.plan.walk import Step, reference_home, walk
from app.domain.rules import check_plan
from app.domain.run.remaining_mission import Flown, RemainingMission, continued, rest_of
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import FlightRegime, InFlight, VehicleProfile
from tests.contract.feasibility.autopilot import facts_of, refusals
from tests.support.plans_and_vehicles import Case, cases

MANY = settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))


def test_the_rest_of_any_flight_visits_no_drop_that_is_over_and_is_taken_by_the_autopilot_in_the_air() -> None:
    flown_on = 0

    @MANY
    @given(cases(), st.data())
    def law(case: Case, data: st.DataObject) -> None:
        nonlocal flown_on
        facts = facts_of(case.plan.vehicle_type, case.params, case.profile)
        step = data.draw(st.sampled_from(walk(case.plan, reference_home(case.plan, facts))))
        if isinstance(step.item, Jump | Takeoff) or step.before is FlightRegime.GROUND:
            return
        drops = [drop.item.id for drop in drops_of(walk(case.plan, reference_home(case.plan, facts))) if drop.releases]
        concluded = data.draw(st.sets(st.sampled_from(drops))) if drops else set()
        passed = [item.id for item in case.plan.items[: step.index]]
        target = data.draw(st.none() | st.sampled_from([item.id for item in case.plan.items]))
        try:
            rest = continued(Flown(case.plan, passed, step.item.id, concluded), case.plan, target, step.before)
        except PlanRejectedError:
            return
        in_flight = replace(facts, in_flight=_here(step))
        if any(finding.severity is Severity.ERROR for finding in check_plan(rest.plan, in_flight)):
            return
        flown_on += 1
        _holds(rest, case, in_flight, concluded, target or step.item.id)

    law()
    assert flown_on > 15, "too few flights went on to show anything"


def _holds(rest: RemainingMission, case: Case, facts: VehicleProfile, concluded: set[str], continue_at: str) -> None:
    mission = compile_plan(rest.plan, facts)
    left = {item.id for item in rest.plan.items}
    assert not left & concluded
    assert not {drop.plan_item_id for drop in mission.drops} & concluded
    embedded = {drop.release_seq for drop in mission.drops if drop.release_seq is not None}
    releases = {item.seq for item in mission.items if item.command is MavCmd.DO_GRIPPER and item.param2 == 0.0}
    assert releases <= embedded, "every release on board belongs to a drop that is still open"
    assert not any(item.command in (MavCmd.NAV_TAKEOFF, MavCmd.NAV_VTOL_TAKEOFF) for item in mission.items)
    told = refusals(mission, case.plan.vehicle_type, case.params, case.profile, landed=False)
    assert told == []
    again: Plan = rest_of(case.plan, continue_at, rest.omitted).plan
    assert again == rest.plan, "a restart makes the same mission of what was recorded"


def _here(step: Step) -> InFlight:
    return InFlight(
        latitude_deg=step.start.latitude_deg,
        longitude_deg=step.start.longitude_deg,
        relative_altitude_m=step.start.relative_altitude_m,
        wing_borne=step.before is FlightRegime.FIXED_WING,
    )
