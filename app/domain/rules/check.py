"""Checks a plan against every rule and returns all that is wrong at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from app.domain.airspace.geofence import FenceArea, fence_area
from app.domain.autopilot import behaviour
from app.domain.geo import LocalProjection
from app.domain.plan.compiler import mission_seqs
from app.domain.plan.document import Plan
from app.domain.plan.drops import drops_of, over_alternates
from app.domain.plan.walk import reference_home, speeds_along, walk
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
    takeoff_landing,
    vehicle,
)
from app.domain.rules.alternate import detour_findings
from app.domain.rules.registry import Assumptions, Rule, RuleContext
from app.domain.validation.finding import Finding, Severity
from app.domain.vehicle.state import VehicleProfile

RULES: tuple[Rule, ...] = (
    *gripper.RULES,
    *alternate.RULES,
    *alternate.CONSENT_RULES,
    *moving_target.RULES,
    *braking.RULES,
    *takeoff_landing.RULES,
    *fixed_wing.VTOL_RULES,
    *fixed_wing.RULES,
    *vehicle.COMMAND_RULES,
    *geofence.RULES,
    *limits.RULES,
    *performance.PAYLOAD_RULES,
    *performance.BATTERY_RULES,
    *fixed_wing.WIND_RULES,
    *vehicle.RULES,
)


@dataclass(frozen=True, slots=True)
class CheckedPlan:
    """What was found in a plan, and the flight that the rules looked at."""

    findings: tuple[Finding, ...]
    timeline: Timeline


def check_plan(plan: Plan, facts: VehicleProfile | None, wind: Wind = CALM) -> tuple[Finding, ...]:
    """All findings, errors first, else in the order of the plan. What is not known of a vehicle is assumed.

    Without a vehicle what rests on an assumption is a warning: the plan is wrong only if no vehicle could fly it. Of a
    named vehicle that does not tell a fact it is an error: what is accepted for a vehicle, it must accept.

    The way over the alternates is checked like the plan itself: an alternate breaks no fence and no limit. Plan and
    way are predicted once.
    """
    findings, _ = _looked_at(plan, facts, wind)
    return findings


def checked(plan: Plan, facts: VehicleProfile | None, wind: Wind = CALM) -> CheckedPlan:
    """As `check_plan`, with the timeline: for the type's defaults if no vehicle of the plan's type is given."""
    findings, predicted = _looked_at(plan, facts, wind)
    return CheckedPlan(findings, predicted().timeline)


def _looked_at(
    plan: Plan, facts: VehicleProfile | None, wind: Wind
) -> tuple[tuple[Finding, ...], Callable[[], Prediction]]:
    assumptions = Assumptions()
    known = facts if facts is not None and facts.vehicle_type is plan.vehicle_type else None
    assumed = replace(known or VehicleProfile(plan.vehicle_type), assuming=assumptions.add)
    look = _Look(facts, assumed, assumptions, wind)
    context = look.at(plan, lambda: predicted().timeline)
    predicted = assumptions.remembered(lambda: predict_all(plan, assumed, wind, context.steps, context.seqs_of()))
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

    vehicle: VehicleProfile | None
    facts: VehicleProfile
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
            seqs_of=once(lambda: mission_seqs(plan, facts, steps)),
        )


def _fence(plan: Plan, facts: VehicleProfile, projection: LocalProjection) -> FenceArea | None:
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


# The page of all rules, made from the rules themselves.


_HEAD = """# Rules

<!-- Generated from app/domain/rules; `python -m tests.support.regenerate_golden_missions` writes it anew. -->

Every plan is checked against all of these before anything is sent, and all findings are returned at once, each with
its code, a JSON pointer into the plan, a sentence and a hint. An **error** stops the plan; a **warning** is shown and
kept with the run. Codes are stable. Codes that begin with `plan.` are about the document itself: see
[plan-format.md](plan-format.md). "Flown" means: seen on PX4 main (v1.18) in SITL.

## What is assumed

Many rules need facts of the vehicle: parameters, firmware, home, how much it stores. A finding that rests on facts that
are not known lists them in `assumed`.

- **No vehicle is named** (`POST /plans`, `waydrop validate` without `--vehicle`): PX4's defaults are assumed, and a
  finding that rests on them is a warning that begins with "depends on the vehicle:". The plan is refused only for what
  no vehicle could fly. A run, a job or a check with a vehicle decides by what that one tells. `home` of the plan counts
  as known.
- **A vehicle is named and does not tell a fact**: PX4's default is assumed (where firmware versions differ, what the
  rule says), and the finding stays an error: a plan that is accepted for a vehicle must be accepted by it. The sentence
  says what was assumed. A parameter that does not answer refuses nothing by itself, for old firmware lacks some.
- **Nobody knows home**: heights of absolute altitudes are not checked, and that is said
  (`vehicle.altitudes_not_comparable`). A vehicle without a home is refused (`vehicle.home_unknown`).

## All rules

| code | severity | why | source |
|---|---|---|---|
"""


def rules_page() -> str:
    """Markdown: one line a rule, in the order in which they are checked."""
    return _HEAD + "".join(_line(rule) for rule in RULES)


def _line(rule: Rule) -> str:
    cells = (f"`{rule.code}`", str(rule.severity), rule.reason, rule.source)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"
