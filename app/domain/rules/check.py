"""Checks a plan against every rule and returns all that is wrong at once."""

from __future__ import annotations

from functools import cache

from app.domain.default_facts import default_facts
from app.domain.fence_area import FenceArea, fence_area, needs_all_inclusions
from app.domain.finding import Finding, Severity
from app.domain.geo import LocalProjection
from app.domain.plan.detour import over_alternates
from app.domain.plan.document import Plan
from app.domain.plan.drops import drops_of
from app.domain.plan.walk import reference_home, walk
from app.domain.prediction import predict
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


def check_plan(plan: Plan, facts: VehicleFacts | None, wind: Wind = CALM) -> tuple[Finding, ...]:
    """All findings, errors first, else in the order of the plan. Without facts the type's defaults are assumed.

    The way over the alternates is checked like the plan itself: an alternate breaks no fence and no limit.
    """
    context = context_of(plan, facts, wind)
    findings = _broken(context)
    detour = over_alternates(plan, context.home, context.facts.in_flight)
    if detour is not None:
        over = _broken(context_of(detour.plan, facts, wind))
        findings |= set(detour_findings(detour, over, findings))
    return tuple(sorted(findings, key=_order))


def _broken(context: RuleContext) -> set[Finding]:
    return {finding for rule in RULES for finding in rule.findings(context)}


def context_of(plan: Plan, vehicle: VehicleFacts | None, wind: Wind = CALM) -> RuleContext:
    """What the rules look at, computed once. A vehicle of another type is one finding of its own."""
    facts = vehicle if vehicle is not None else default_facts(plan.vehicle_type)
    if facts.vehicle_type is not plan.vehicle_type:
        facts = default_facts(plan.vehicle_type)
    home = reference_home(plan, facts)
    steps = walk(plan, home, in_flight=facts.in_flight)
    projection = LocalProjection(home.latitude_deg, home.longitude_deg)
    fenced = plan.geofence.polygons or plan.geofence.circles
    return RuleContext(
        plan=plan,
        vehicle=vehicle,
        facts=facts,
        home=home,
        steps=steps,
        speeds_m_s=speeds_along(plan, facts, steps),
        drops=drops_of(steps),
        projection=projection,
        fence=_fence(plan, facts, projection) if fenced else None,
        wind=wind,
        timeline=cache(lambda: predict(plan, facts, wind)),
    )


def _fence(plan: Plan, facts: VehicleFacts, projection: LocalProjection) -> FenceArea:
    return fence_area(plan.geofence, projection, all_of_home=needs_all_inclusions(facts.firmware))


def _order(finding: Finding) -> tuple[bool, list[tuple[bool, int, str]], str]:
    parts = [(not part.isdigit(), int(part) if part.isdigit() else 0, part) for part in finding.pointer.split("/")]
    return finding.severity is not Severity.ERROR, parts, finding.code
