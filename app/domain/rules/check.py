"""Checks a plan against every rule and returns all that is wrong at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from app.domain.autopilot import behaviour
from app.domain.fence_area import FenceArea, fence_area
from app.domain.finding import Finding, Severity
from app.domain.geo import LocalProjection
from app.domain.plan.detour import over_alternates
from app.domain.plan.document import Plan
from app.domain.plan.drops import drops_of
from app.domain.plan.walk import reference_home, walk
from app.domain.prediction import Prediction, Timeline, predict_all
from app.domain.prediction.wind import CALM, Wind
from app.domain.rules import (
    alternate,
    battery,
    braking,
    commands,
    consent,
    fixed_wing,
    geofence,
    gripper,
    limits,
    moving_target,
    payload,
    takeoff_landing,
    vehicle,
    vtol,
    wind_limits,
)
from app.domain.rules.assumptions import Assumptions
from app.domain.rules.detour import detour_findings
from app.domain.rules.registry import Rule, RuleContext
from app.domain.speeds import speeds_along
from app.domain.vehicle import VehicleFacts

RULES: tuple[Rule, ...] = (
    *gripper.RULES,
    *alternate.RULES,
    *consent.RULES,
    *moving_target.RULES,
    *braking.RULES,
    *takeoff_landing.RULES,
    *vtol.RULES,
    *fixed_wing.RULES,
    *commands.RULES,
    *geofence.RULES,
    *limits.RULES,
    *payload.RULES,
    *battery.RULES,
    *wind_limits.RULES,
    *vehicle.RULES,
)


@dataclass(frozen=True, slots=True)
class CheckedPlan:
    """What was found in a plan, and the flight that the rules looked at."""

    findings: tuple[Finding, ...]
    timeline: Timeline


def check_plan(plan: Plan, facts: VehicleFacts | None, wind: Wind = CALM) -> tuple[Finding, ...]:
    """All findings, errors first, else in the order of the plan. What is not known of a vehicle is assumed.

    Without a vehicle what rests on an assumption is a warning: the plan is wrong only if no vehicle could fly it. Of a
    named vehicle that does not tell a fact it is an error: what is accepted for a vehicle, it must accept.

    The way over the alternates is checked like the plan itself: an alternate breaks no fence and no limit. Plan and
    way are predicted once.
    """
    findings, _ = _looked_at(plan, facts, wind)
    return findings


def checked(plan: Plan, facts: VehicleFacts | None, wind: Wind = CALM) -> CheckedPlan:
    """As `check_plan`, with the timeline: for the type's defaults if no vehicle of the plan's type is given."""
    findings, predicted = _looked_at(plan, facts, wind)
    return CheckedPlan(findings, predicted().timeline)


def _looked_at(
    plan: Plan, facts: VehicleFacts | None, wind: Wind
) -> tuple[tuple[Finding, ...], Callable[[], Prediction]]:
    assumptions = Assumptions()
    known = facts if facts is not None and facts.vehicle_type is plan.vehicle_type else None
    assumed = replace(known or VehicleFacts(plan.vehicle_type), assuming=assumptions.add)
    predicted = assumptions.remembered(lambda: predict_all(plan, assumed, wind))
    look = _Look(facts, assumed, assumptions, wind)
    context = look.at(plan, lambda: predicted().timeline)
    findings = _broken(context)
    detour = over_alternates(plan, context.origin, assumed.in_flight)
    if detour is not None:
        over = _broken(look.at(detour.plan, lambda: _over(predicted())))
        findings |= set(detour_findings(detour, over, findings))
    return tuple(sorted(findings, key=_order)), predicted


def _over(predicted: Prediction) -> Timeline:
    assert predicted.over is not None, "it has a detour, and is predicted over it"
    return predicted.over


def _broken(context: RuleContext) -> set[Finding]:
    return {finding for rule in RULES for finding in rule.findings(context)}


@dataclass(frozen=True, slots=True)
class _Look:
    """Who flies and in which wind. `facts` tell `assumptions` what they do not know."""

    vehicle: VehicleFacts | None
    facts: VehicleFacts
    assumptions: Assumptions
    wind: Wind

    def at(self, plan: Plan, timeline: Callable[[], Timeline]) -> RuleContext:
        """What the rules look at, computed once. A vehicle of another type is one finding of its own."""
        facts, once = self.facts, self.assumptions.remembered
        home = reference_home(plan, facts)
        steps = walk(plan, home, in_flight=facts.in_flight)
        projection = LocalProjection(home.latitude_deg, home.longitude_deg)
        return RuleContext(
            plan=plan,
            vehicle=self.vehicle,
            facts=facts,
            assumptions=self.assumptions,
            origin=home,
            steps=steps,
            drops=drops_of(steps),
            projection=projection,
            fence_area=once(lambda: _fence(plan, facts, projection)),
            flown_speeds_m_s=once(lambda: speeds_along(plan, facts, steps)),
            wind=self.wind,
            timeline=timeline,
        )


def _fence(plan: Plan, facts: VehicleFacts, projection: LocalProjection) -> FenceArea | None:
    fence = plan.geofence
    kinds = [*(polygon.kind for polygon in fence.polygons), *(circle.kind for circle in fence.circles)]
    if not kinds:
        return None
    if kinds.count("inclusion") < 2:
        return fence_area(fence, projection)
    reference_home(plan, facts)  # it decides which inclusions count
    return fence_area(fence, projection, all_of_home=behaviour(facts).needs_all_inclusions)


def _order(finding: Finding) -> tuple[bool, list[tuple[bool, int, str]], str]:
    parts = [(not part.isdigit(), int(part) if part.isdigit() else 0, part) for part in finding.pointer.split("/")]
    return finding.severity is not Severity.ERROR, parts, finding.code
