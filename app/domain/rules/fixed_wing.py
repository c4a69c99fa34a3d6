"""Rules for the landing pattern and the turns of fixed wings."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.carried import Carried
from app.domain.finding import Severity
from app.domain.geo import distance_m
from app.domain.items import Land
from app.domain.items.landing_pattern import LandingPattern, landing_pattern
from app.domain.plan.walk import Step
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item
from app.domain.vehicle import VehicleType


def _above_touchdown(context: RuleContext) -> Iterator[Violation]:
    for step, pattern in _patterns(context):
        if pattern.height_m <= 0:
            message = "the approach is not above the landing place"
            yield at_item(step, message, "raise the approach, or leave it out to have one computed", "approach")


def _outside_circle(context: RuleContext) -> Iterator[Violation]:
    for step, pattern in _patterns(context):
        if pattern.glide_m <= 0:
            message = "the landing place lies inside the circle of its approach"
            yield at_item(step, message, "move the approach away, or make its radius smaller", "approach")


def _slope(context: RuleContext) -> Iterator[Violation]:
    steepest = context.behaviour.steepest_glide
    for step, pattern in _patterns(context):
        if pattern.height_m > 0 and pattern.glide_m > 0 and pattern.glide_angle_deg > steepest.value:
            angle_deg = pattern.glide_angle_deg
            message = f"the glide of {angle_deg:.1f} degrees is steeper than {steepest.value:.1f} ({steepest.name})"
            yield at_item(step, message, "start the approach lower or farther away", "approach")


def _landing_ends_the_plan(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for step in context.steps[:-1]:
        if step.item.is_stop and step.item.lands:
            message = "a fixed wing's landing ends its flight, but more items follow"
            yield at_item(step, message, "move the landing to the end")


def _return_never_lands(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for step in context.steps:
        if step.item.goes_home:
            message = "a fixed wing that returns circles over home and does not land by itself"
            yield at_item(step, message, "end the plan with a land item")


def _approach_used(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is VehicleType.FIXED_WING:
        return
    for step in context.steps:
        if isinstance(step.item, Land) and step.item.approach is not None:
            message = f"a {context.plan.vehicle_type} lands from above; the approach is ignored"
            yield at_item(step, message, "leave it out", "approach")


def _room_to_turn(context: RuleContext) -> Iterator[Violation]:
    for step, speed_m_s in zip(context.steps, context.speeds_m_s, strict=True):
        if not (step.item.holds() and step.before is step.after is Carried.FIXED_WING):
            continue
        start, end = step.start, step.end
        leg_m = distance_m(start.latitude_deg, start.longitude_deg, end.latitude_deg, end.longitude_deg)
        switch_m = context.behaviour.switch_distance_m(speed_m_s)
        if leg_m < 2 * switch_m:
            message = f"a leg of {leg_m:.0f} m is shorter than twice the switch distance of {switch_m:.0f} m"
            yield at_item(step, message, "make it longer: the vehicle turns away before it is on this leg")


def _patterns(context: RuleContext) -> Iterator[tuple[Step, LandingPattern]]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for step in context.steps:
        if isinstance(step.item, Land) and _knows_drop(context, step.item):
            yield step, landing_pattern(step.item, step.item.approach, step.start, context.origin, context.facts)


def _knows_drop(context: RuleContext, item: Land) -> bool:
    """How far its approach goes down: both altitudes are of one kind, or home is known."""
    alike = item.approach is None or (item.approach.relative_altitude_m is None) is (item.relative_altitude_m is None)
    return alike or context.knows_home


_APPROACH = "PX4 FeasibilityChecker, fixed-wing landing approach"
RULES = (
    Rule(
        "fixed_wing.approach_below_landing",
        Severity.ERROR,
        "The item before LAND must be higher than the landing.",
        _APPROACH,
        _above_touchdown,
    ),
    Rule(
        "fixed_wing.landing_inside_circle",
        Severity.ERROR,
        "The landing must lie outside the orbit of the approach.",
        _APPROACH,
        _outside_circle,
    ),
    Rule(
        "fixed_wing.glide_too_steep",
        Severity.ERROR,
        "A glide steeper than FW_LND_ANG + 0.1 degrees makes the mission infeasible.",
        f"{_APPROACH} (flown).",
        _slope,
    ),
    Rule(
        "fixed_wing.landing_not_last",
        Severity.ERROR,
        "At most one DO_LAND_START, and nothing takes a fixed wing off the ground again.",
        "PX4 FeasibilityChecker: more than one land start.",
        _landing_ends_the_plan,
    ),
    Rule(
        "fixed_wing.return_does_not_land",
        Severity.ERROR,
        "After a return a fixed wing loiters (RTL_LAND_DELAY -1): the flight never ends.",
        "PX4 rtl.cpp; a return after a landing start is infeasible too.",
        _return_never_lands,
    ),
    Rule(
        "landing.approach_ignored",
        Severity.WARNING,
        "Only fixed wings fly the approach of a land item.",
        "Ours.",
        _approach_used,
    ),
    Rule(
        "fixed_wing.leg_too_short",
        Severity.WARNING,
        "A fixed wing counts a waypoint as reached one switch distance before it and cuts the corner.",
        "PX4 NPFG switch distance (flown).",
        _room_to_turn,
    ),
)
