"""Checks a plan against every rule and returns all findings at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from app.domain.airspace.fence_route import FenceRoutes
from app.domain.airspace.geofence import FenceArea, fence_area
from app.domain.autopilot import behaviour
from app.domain.errors import PlanRejectedError
from app.domain.geo import LocalProjection
from app.domain.plan.compiler import DraftedPlan, draft
from app.domain.plan.document import Plan
from app.domain.plan.drops import drops_of, over_alternates
from app.domain.plan.walk import Step, reference_home, speeds_along, walk
from app.domain.prediction import Prediction, Timeline, predict_all
from app.domain.prediction.motion import CALM, Wind
from app.domain.rules import (
    alternate,
    braking,
    fixed_wing,
    geofence,
    gripper,
    limits,
    moving_target,
    performance,
    return_heights,
    takeoff_landing,
    vehicle,
    weather,
)
from app.domain.rules.alternate import detour_findings
from app.domain.rules.registry import Assumptions, Rule, RuleContext
from app.domain.validation.finding import Finding, Severity
from app.domain.vehicle.state import GlobalPosition, VehicleProfile

FILES = (
    *(gripper, alternate, moving_target, braking, takeoff_landing, fixed_wing, weather),
    *(geofence, limits, return_heights, performance, vehicle),
)
RULES: tuple[Rule, ...] = tuple(rule for file in FILES for rule in file.rules.all)


@dataclass(frozen=True, slots=True)
class CheckedPlan:
    """The findings of a plan, and the flight and the mission that the rules examined.

    `drafted` is None if the plan has no mission for the vehicle: see `draft`, and the findings.
    """

    findings: tuple[Finding, ...]
    timeline: Timeline
    drafted: DraftedPlan | None


def check_plan(plan: Plan, facts: VehicleProfile | None, wind: Wind = CALM) -> tuple[Finding, ...]:
    """Check a plan. Returns all findings, errors first, then in plan order. Unknown facts of the vehicle are assumed.

    Without a vehicle, findings that depend on an assumption are warnings: only a plan that no vehicle can fly is
    rejected. With a vehicle, they are errors: a plan that is accepted for a vehicle must be accepted by it.

    The route over the alternates is checked like the plan itself. Plan and route are predicted once.
    """
    return _looked_at(plan, facts, wind)[0]


def checked(plan: Plan, facts: VehicleProfile | None, wind: Wind = CALM) -> CheckedPlan:
    """Like `check_plan`, with the timeline and the mission. Uses the defaults of the plan's vehicle type without a
    suitable vehicle.
    """
    findings, walked, predicted = _looked_at(plan, facts, wind)
    is_suited = facts is None or facts.vehicle_type is plan.vehicle_type
    return CheckedPlan(findings, predicted().timeline, walked.drafted() if is_suited else None)


def _looked_at(
    plan: Plan, facts: VehicleProfile | None, wind: Wind
) -> tuple[tuple[Finding, ...], _Walked, Callable[[], Prediction]]:
    assumptions = Assumptions()
    known = facts if facts is not None and facts.vehicle_type is plan.vehicle_type else None
    assumed = replace(known or VehicleProfile(plan.vehicle_type), assuming=assumptions.add)
    look = _Look(facts, assumed, assumptions, wind)
    walked = look.walk(plan)
    predicted = assumptions.remembered(lambda: predict_all(plan, assumed, wind, walked.steps, walked.seqs_of()))
    findings = _broken(look.at(plan, walked, lambda: predicted().timeline))
    detour = over_alternates(plan, walked.home, assumed.in_flight)
    if detour is not None:
        over = _broken(look.at(detour.plan, look.walk(detour.plan), lambda: _over(predicted())))
        findings |= set(detour_findings(detour, over, findings))
    return tuple(sorted(findings, key=_order)), walked, predicted


def _over(predicted: Prediction) -> Timeline:
    assert predicted.over is not None, "a plan with a detour is predicted over it"
    return predicted.over


def _broken(context: RuleContext) -> set[Finding]:
    return {finding for rule in RULES for finding in rule.findings(context)}


class _Walked(NamedTuple):
    """The walk along a plan, without the context: the prediction refers to it and must not refer to itself."""

    home: GlobalPosition
    steps: tuple[Step, ...]
    drafted: Callable[[], DraftedPlan | None]

    def seqs_of(self) -> Mapping[str, Sequence[int]]:
        """Empty if the plan has no mission."""
        found = self.drafted()
        return {} if found is None else found.seqs_of


@dataclass(frozen=True, slots=True)
class _Look:
    """The vehicle and the wind. `facts` report unknown facts to `assumptions`."""

    vehicle: VehicleProfile | None
    facts: VehicleProfile
    assumptions: Assumptions
    wind: Wind

    def walk(self, plan: Plan) -> _Walked:
        facts = self.facts
        home = reference_home(plan, facts)
        steps = walk(plan, home, in_flight=facts.in_flight)
        return _Walked(home, steps, self.assumptions.remembered(lambda: _drafted(plan, facts, steps)))

    def at(self, plan: Plan, walked: _Walked, timeline: Callable[[], Timeline]) -> RuleContext:
        """Build the context of the rules once. A vehicle of another type is a finding of its own."""
        facts, once = self.facts, self.assumptions.remembered
        home, steps = walked.home, walked.steps
        projection = LocalProjection(home.latitude_deg, home.longitude_deg)
        fence = once(lambda: _fence(plan, facts, projection))
        return RuleContext(
            plan=plan,
            vehicle=self.vehicle,
            facts=facts,
            assumptions=self.assumptions,
            origin=home,
            steps=steps,
            drops=drops_of(steps),
            projection=projection,
            fence_area=fence,
            fence_routes=once(lambda: _routes(fence(), facts)),
            flown_speeds_m_s=once(lambda: speeds_along(plan, facts, steps)),
            wind=self.wind,
            timeline=timeline,
            seqs_of=walked.seqs_of,
        )


def _drafted(plan: Plan, facts: VehicleProfile, steps: Sequence[Step]) -> DraftedPlan | None:
    try:
        return draft(plan, facts, steps)
    except PlanRejectedError:
        return None


def _fence(plan: Plan, facts: VehicleProfile, projection: LocalProjection) -> FenceArea | None:
    fence = plan.geofence
    kinds = [*(polygon.kind for polygon in fence.polygons), *(circle.kind for circle in fence.circles)]
    if not kinds:
        return None
    if kinds.count("inclusion") < 2:
        return fence_area(fence, projection)
    reference_home(plan, facts)  # decides which inclusion fences count
    return fence_area(fence, projection, all_of_home=behaviour(facts).needs_all_inclusions)


def _routes(area: FenceArea | None, facts: VehicleProfile) -> FenceRoutes | None:
    return None if area is None else FenceRoutes(area, behaviour(facts).return_margin_m)


def _order(finding: Finding) -> tuple[bool, list[tuple[bool, int, str]], str]:
    parts = [(not part.isdigit(), int(part) if part.isdigit() else 0, part) for part in finding.pointer.split("/")]
    return finding.severity is not Severity.ERROR, parts, finding.code
