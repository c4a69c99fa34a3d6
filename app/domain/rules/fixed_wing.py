"""Rules for fixed wings and VTOLs: landing patterns, turns and transitions."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.autopilot import Quantity
from app.domain.geo import distance_m
from app.domain.items import Land
from app.domain.items.landing_pattern import LandingPattern, landing_pattern
from app.domain.plan.walk import Step
from app.domain.prediction.wing import tightest_circle_m
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.state import FlightRegime, VehicleType

rules = RuleSet()
_APPROACH = "PX4 FeasibilityChecker, fixed-wing landing approach"


@rules.error("fixed_wing.approach_below_landing", "The item before LAND must be higher than the landing.", _APPROACH)
def _above_touchdown(context: RuleContext) -> Iterator[Violation]:
    for step, pattern in _patterns(context):
        if pattern.height_m <= 0:
            message = "the approach is not higher than the landing point"
            yield at_item(step, message, "raise the approach, or remove it to have one computed", "approach")


@rules.error(
    "loiter.radius_too_small",
    "The bank of a wing limits how tightly it turns at its speed. A smaller circle is overshot, and a drop "
    "on it is farther from the point than the radius.",
    "PX4 (recorded): 43 degrees of bank; flown: 15 m from the point on a circle of 1 m.",
)
def _circle_can_be_flown(context: RuleContext) -> Iterator[Violation]:
    hint = "increase the radius, or fly slower"
    for step, speed_m_s in zip(context.steps, context.speeds_m_s, strict=True):
        if not step.item.circles() or step.after is not FlightRegime.FIXED_WING:
            continue
        own_m, tightest_m = step.item.circle_radius_m(), tightest_circle_m(speed_m_s)
        radius_m = abs(own_m or context.behaviour.quantity(Quantity.LOITER_RADIUS_M))
        if radius_m < tightest_m:
            yield at_item(step, _too_tight(radius_m, speed_m_s, tightest_m), hint, *(["radius_m"] if own_m else []))
    for step, pattern in _patterns(context):  # it descends at its slowest speed
        slow_m_s = context.behaviour.quantity(Quantity.WING_SLOWEST_M_S)
        radius_m, tightest_m = abs(pattern.radius_m), tightest_circle_m(slow_m_s)
        if radius_m < tightest_m:
            yield at_item(step, _too_tight(radius_m, slow_m_s, tightest_m), hint, "approach")


def _too_tight(radius_m: float, speed_m_s: float, tightest_m: float) -> str:
    return f"a circle of {radius_m:g} m is too tight at {speed_m_s:g} m/s: the vehicle needs {tightest_m:.0f} m"


@rules.error("fixed_wing.landing_inside_circle", "The landing must lie outside the orbit of the approach.", _APPROACH)
def _outside_circle(context: RuleContext) -> Iterator[Violation]:
    for step, pattern in _patterns(context):
        if pattern.glide_m <= 0:
            message = "the landing point lies inside the circle of the approach"
            yield at_item(step, message, "move the approach away, or reduce its radius", "approach")


@rules.error(
    "fixed_wing.glide_too_steep",
    "A glide slope steeper than FW_LND_ANG + 0.1 degrees makes the mission infeasible.",
    f"{_APPROACH} (flown).",
)
def _slope(context: RuleContext) -> Iterator[Violation]:
    steepest = context.behaviour.steepest_glide
    for step, pattern in _patterns(context):
        if pattern.height_m > 0 and pattern.glide_m > 0 and pattern.glide_angle_deg > steepest.value:
            angle_deg = pattern.glide_angle_deg
            message = (
                f"the glide slope of {angle_deg:.1f} degrees is steeper than {steepest.value:.1f} ({steepest.name})"
            )
            yield at_item(step, message, "start the approach lower or farther away", "approach")


@rules.error(
    "fixed_wing.landing_not_last",
    "A mission has at most one DO_LAND_START, and a fixed wing does not take off again.",
    "PX4 FeasibilityChecker: more than one land start.",
)
def _landing_ends_the_plan(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for step in context.steps[:-1]:
        if step.item.is_stop and step.item.lands:
            message = "the landing of a fixed wing ends the flight, but more items follow"
            yield at_item(step, message, "move the landing to the end")


@rules.error(
    "fixed_wing.return_does_not_land",
    "After a return, a fixed wing loiters (RTL_LAND_DELAY -1), so the flight never ends.",
    "PX4 rtl.cpp; a return after a landing start is infeasible too.",
)
def _return_never_lands(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for step in context.steps:
        if step.item.goes_home:
            message = "after a return, a fixed wing loiters over home and does not land by itself"
            yield at_item(step, message, "end the plan with a land item")


@rules.warning("landing.approach_ignored", "Only fixed wings fly the approach of a land item.", "Waydrop.")
def _approach_used(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is VehicleType.FIXED_WING:
        return
    for step in context.steps:
        if isinstance(step.item, Land) and step.item.approach is not None:
            message = f"{context.plan.vehicle_type.noun} lands vertically; the approach is ignored"
            yield at_item(step, message, "remove it", "approach")


@rules.warning(
    "fixed_wing.leg_too_short",
    "A fixed wing reaches a waypoint one switch distance before it and cuts the corner.",
    "PX4 NPFG switch distance (flown).",
)
def _room_to_turn(context: RuleContext) -> Iterator[Violation]:
    for number, step in enumerate(context.steps):
        if not (step.before is step.after is FlightRegime.FIXED_WING and step.item.holds()):
            continue
        start, end = step.start, step.end
        leg_m = distance_m(start.latitude_deg, start.longitude_deg, end.latitude_deg, end.longitude_deg)
        switch_m = context.behaviour.switch_distance_m(context.speeds_m_s[number])
        if leg_m < 2 * switch_m:
            message = f"the leg of {leg_m:.0f} m is shorter than twice the switch distance of {switch_m:.0f} m"
            yield at_item(step, message, "make it longer: the vehicle turns away before it follows this leg")


def _patterns(context: RuleContext) -> Iterator[tuple[Step, LandingPattern]]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for step in context.steps:
        if isinstance(step.item, Land) and _knows_drop(context, step.item):
            yield step, landing_pattern(step.item, step.item.approach, step.start, context.origin, context.facts)


def _knows_drop(context: RuleContext, item: Land) -> bool:
    """Whether the descent of the approach is known: both altitudes are of the same kind, or home is known."""
    alike = item.approach is None or (item.approach.relative_altitude_m is None) is (item.relative_altitude_m is None)
    return alike or context.knows_home


_STATE = {"fixed_wing": FlightRegime.FIXED_WING, "multicopter": FlightRegime.ROTARY_WING}


@rules.error(
    "vtol.items_only_on_vtol",
    "VTOL items make the mission of any other vehicle infeasible.",
    "PX4 FeasibilityChecker: VTOL items only on VTOL.",
)
def _only_vtol(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is VehicleType.VTOL:
        return
    for step in context.steps:
        if step.item.transition_to() is not None:
            message = f"{context.plan.vehicle_type.noun} has no transitions"
            yield at_item(step, message, "remove the item, or write the plan for a VTOL")


@rules.error(
    "vtol.transition_on_ground",
    "A transition is possible in flight only.",
    "PX4 commander: transition denied when landed.",
)
def _in_the_air(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.VTOL:
        return
    for step in context.steps:
        if step.item.transition_to() is not None and step.before is FlightRegime.GROUND:
            message = "a transition on the ground"
            yield at_item(step, message, "move it after the takeoff, or after the waypoint that takes off again")


@rules.warning(
    "vtol.transition_without_effect",
    "A transition to the current state has no effect. Another transition is probably missing.",
    "PX4 NAV_VTOL_TAKEOFF transitions by itself (flown).",
)
def _changes_something(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.VTOL:
        return
    for step in context.steps:
        to = step.item.transition_to()
        if to is not None and step.before is _STATE[to]:
            message = f"the vehicle is already in {to} flight"
            yield at_item(step, message, "remove the item: a VTOL takeoff ends with a transition", "to")


@rules.error(
    "vtol.return_to_landing",
    "A return to the mission landing (RTL_TYPE 1 or 3) that begins in wing flight below RTL_RETURN_ALT descends to the "
    "landing without a back-transition, and hits the ground beyond it. RTL_TYPE 1 is the airframe default of VTOLs.",
    "PX4 rtl_direct_mission_land.cpp, MissionBase::handleLanding (flown: 6 to 8 m/s, 39 to 43 m beyond the pad).",
)
def _returns_elsewhere(context: RuleContext) -> Iterator[Violation]:
    """The first landing is the mission landing."""
    if context.plan.vehicle_type is not VehicleType.VTOL:
        return
    landing = next((step for step in context.steps if step.item.is_stop and step.item.lands), None)
    if landing is None or not (returns := context.behaviour.returns).to_landing:
        return
    message = f"with {returns.setting}, a return to this landing in wing flight flies the vehicle into the ground"
    yield at_item(landing, message, f"{returns.setting.remedy}: a return then goes to home or a rally point")
