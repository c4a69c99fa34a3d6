"""Rules for limits: the vehicle's storage and speeds, and the limits of the plan itself."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.autopilot import Quantity
from app.domain.autopilot.base import Capacity
from app.domain.plan.walk import OWN_SPEED, Step, asks_for, return_speed_m_s, speed_range_m_s
from app.domain.rules.places import from_home_m, planned_places
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.state import FlightRegime

rules = RuleSet()
_OWN = "`limits` of the plan."


@rules.error(
    "limits.mission_items",
    "A vehicle rejects more items than it can store: 500 by default, 100 on some boards.",
    "PX4 mission storage: MISSION_ACK NO_SPACE (flown).",
)
def _mission_items(context: RuleContext) -> Iterator[Violation]:
    count = sum(len(seqs) for seqs in context.seqs_of().values())  # no items: reported by another rule
    context.assumptions.clear()  # the count does not depend on facts of the vehicle
    most = _most(context, "max_mission_items", context.facts.max_mission_items)
    if count > most:
        message = f"the plan compiles to {count} mission items; the vehicle stores {most}"
        yield Violation("/items", message, "split the plan")


@rules.error(
    "limits.fence_items", "A vehicle stores 64 corners and circles of a geofence by default.", "PX4 mission storage."
)
def _fence_items(context: RuleContext) -> Iterator[Violation]:
    fence = context.plan.geofence
    count = sum(len(polygon.vertices) for polygon in fence.polygons) + len(fence.circles)
    most = _most(context, "max_fence_items", context.facts.max_fence_items)
    if count > most:
        message = f"the geofence has {count} corners and circles; the vehicle stores {most}"
        yield Violation("/geofence", message, "use fewer corners")


@rules.error("limits.rally_points", "A vehicle stores 32 rally points by default.", "PX4 mission storage.")
def _rally_points(context: RuleContext) -> Iterator[Violation]:
    count = len(context.plan.rally_points)
    most = _most(context, "max_rally_points", context.facts.max_rally_points)
    if count > most:
        message = f"{count} rally points; the vehicle stores {most}"
        yield Violation("/rally_points", message, "remove some rally points")


def _most(context: RuleContext, name: Capacity, known: int | None) -> int:
    if known is None:
        context.facts.assuming(name)
        return context.autopilot.usually_stored[name]
    return known


@rules.error(
    "limits.first_waypoint_too_far",
    "Before v1.16, or with unknown firmware, a first waypoint beyond MIS_DIST_1WP makes the mission infeasible.",
    "PX4 FeasibilityChecker.",
)
def _first_waypoint_refused(context: RuleContext) -> Iterator[Violation]:
    if context.behaviour.refuses_far_first_waypoint:
        yield from _first_waypoint(context)


@rules.warning(
    "limits.first_waypoint_far",
    "A first waypoint beyond MIS_DIST_1WP is accepted with a warning. It may be a mistake in the plan.",
    "PX4 FeasibilityChecker since v1.16 (flown).",
)
def _first_waypoint_warned(context: RuleContext) -> Iterator[Violation]:
    if not context.behaviour.refuses_far_first_waypoint:
        yield from _first_waypoint(context)


def _first_waypoint(context: RuleContext) -> Iterator[Violation]:
    most_m = context.behaviour.quantity(Quantity.FIRST_WAYPOINT_M)
    name = context.behaviour.name_of(Quantity.FIRST_WAYPOINT_M)
    first = next(planned_places(context), None)
    away_m = 0.0 if first is None else from_home_m(context, first.place)
    if first is not None and 0 < most_m <= away_m:
        message = f"the first position is {away_m:.0f} m from home, beyond the limit of {most_m:g} m ({name})"
        yield at_item(first.step, message, "check the position, or insert a waypoint closer to home before it")


@rules.warning(
    "limits.below_home",
    "PX4 only warns about waypoints below home, and flies to them.",
    "PX4 FeasibilityChecker (flown).",
)
def _below_home(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps:
        altitude = step.item.altitude() if step.item.is_stop and step.item.flies else None
        if altitude is None or not context.knows_height(altitude):
            continue
        if step.end.relative_altitude_m < 0:
            message = f"{-step.end.relative_altitude_m:g} m below home"
            yield at_item(step, message, "check the altitude and its reference (relative or absolute)")


@rules.error("limits.altitude", "No item may be higher than the plan's limit.", _OWN)
def _own_altitude(context: RuleContext) -> Iterator[Violation]:
    most_m = context.plan.limits.max_relative_altitude_m
    if most_m is None:
        return
    for planned in planned_places(context):
        height_m = planned.height_m
        if height_m is not None and height_m > most_m:
            message = f"{height_m:g} m above home; the limit of the plan is {most_m:g} m"
            yield at_item(planned.step, message, "fly lower, or raise limits.max_relative_altitude_m")


@rules.error("limits.distance", "No item may be farther from home than the plan's limit.", _OWN)
def _own_distance(context: RuleContext) -> Iterator[Violation]:
    most_m = context.plan.limits.max_distance_m
    if most_m is None:
        return
    for planned in planned_places(context):
        if (away_m := from_home_m(context, planned.place)) > most_m:
            message = f"{away_m:.0f} m from home; the limit of the plan is {most_m:g} m"
            yield at_item(planned.step, message, "stay closer, or raise limits.max_distance_m")


@rules.error("limits.speed", "No item may be flown faster than the plan's limit (in calm air).", _OWN)
def _own_speed(context: RuleContext) -> Iterator[Violation]:
    most_m_s = context.plan.limits.max_speed_m_s
    if most_m_s is None:
        return
    for step, speed_m_s in zip(context.steps, context.speeds_m_s, strict=True):
        if not step.item.goes_home and speed_m_s > most_m_s:
            message = f"flown at {speed_m_s:g} m/s; the limit of the plan is {most_m_s:g} m/s"
            yield at_item(step, message, "set cruise_speed_m_s, or raise limits.max_speed_m_s")
            return


@rules.error(
    "limits.return_speed",
    "A return that the plan orders is flown at the vehicle's own speed, whatever speed was requested before.",
    "`limits` of the plan; PX4 MPC_XY_CRUISE, FW_AIRSPD_TRIM, RO_SPEED_LIM.",
)
def _own_return_speed(context: RuleContext) -> Iterator[Violation]:
    yield from _ordered_faster(context)


@rules.warning(
    "limits.failsafe_speed",
    "An operator, a pilot or a failsafe may command a return from anywhere, at the vehicle's own speed.",
    "`limits` of the plan; PX4 MPC_XY_CRUISE, FW_AIRSPD_TRIM, RO_SPEED_LIM.",
)
def _own_failsafe_speed(context: RuleContext) -> Iterator[Violation]:
    if any(_ordered_faster(context)):
        return
    for step, speed_m_s in zip(context.steps, context.speeds_m_s, strict=True):
        if said := _faster(context, "a return that is commanded on the way", step.after, speed_m_s):
            yield Violation("/limits/max_speed_m_s", *said)
            return


def _ordered_faster(context: RuleContext) -> Iterator[Violation]:
    """Returns that the plan orders: by an item, or after a failed drop."""
    speeds_m_s = dict(zip((step.index for step in context.steps), context.speeds_m_s, strict=True))
    for step in context.steps:
        said = _faster(context, "the return", step.before, speeds_m_s[step.index]) if step.item.goes_home else None
        if said:
            yield at_item(step, *said)
    if context.plan.contingency.on_drop_failure == "return":
        for drop in context.drops:
            what = "the return after a failed drop"
            if drop.releases and (said := _faster(context, what, drop.carried, speeds_m_s[drop.step.index])):
                yield Violation("/contingency/on_drop_failure", *said)
                return


def _faster(context: RuleContext, what: str, carried: FlightRegime, asked_m_s: float) -> tuple[str, str] | None:
    """Message and hint of a return that begins in this regime, if it is faster than the plan's limit."""
    most_m_s, own = context.plan.limits.max_speed_m_s, OWN_SPEED.get(carried)
    if most_m_s is None or own is None:
        return None
    speed_m_s = return_speed_m_s(context.facts, carried, asked_m_s)
    if speed_m_s <= most_m_s:
        return None
    name = context.behaviour.name_of(own)
    message = f"{what} is flown at {speed_m_s:g} m/s ({name}); the limit of the plan is {most_m_s:g} m/s"
    return message, f"lower {name}, or raise limits.max_speed_m_s"


@rules.error(
    "limits.drop_height",
    "No parcel may be released higher than the plan's limit. A winch counts too, because its line may break.",
    _OWN,
)
def _own_drop_height(context: RuleContext) -> Iterator[Violation]:
    most_m = context.plan.limits.max_drop_height_m
    for drop in context.drops:
        altitude = None if drop.anchor is None else drop.anchor.item.altitude()
        if altitude is None or not context.knows_height(altitude):
            continue  # without a position: reported by another rule
        height_m = drop.step.start.relative_altitude_m
        in_air = drop.carried not in (FlightRegime.GROUND, FlightRegime.WHEELS)
        if most_m is not None and drop.releases and in_air and height_m > most_m:
            message = f"released {height_m:g} m above home; the limit of the plan is {most_m:g} m"
            yield at_item(drop.step, message, "fly lower, or raise limits.max_drop_height_m")


@rules.error("limits.duration", "The predicted flight may not be longer than the plan's limit.", _OWN)
def _own_duration(context: RuleContext) -> Iterator[Violation]:
    most_s = context.plan.limits.max_duration_s
    if most_s is None:
        return
    duration_s = context.timeline().duration_s
    if duration_s > most_s:
        message = f"predicted duration {duration_s:.0f} s; the limit of the plan is {most_s:g} s"
        yield Violation("/limits/max_duration_s", message, "shorten the flight, or raise limits.max_duration_s")


@rules.error(
    "speed.not_flyable",
    "The vehicle silently limits its speed, so the prediction would be wrong.",
    "PX4 FW_AIRSPD_MIN/MAX, MPC_XY_VEL_MAX, RO_SPEED_LIM.",
)
def _flyable_speed(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps:
        if (asked_m_s := step.item.asked_speed_m_s()) is not None:
            problem = _speed_problem(context, step, asked_m_s)
            if problem:
                yield at_item(step, problem, "the vehicle would fly at its own limit instead", "speed_m_s")
    wanted = context.plan.cruise_speed_m_s
    first = next((step for step in context.steps if step.item.takes_off), context.steps[0])
    problem = _speed_problem(context, first, wanted) if wanted is not None else ""
    if problem:
        yield Violation("/cruise_speed_m_s", problem, "the vehicle would fly at its own limit instead")


def _speed_problem(context: RuleContext, step: Step, speed_m_s: float) -> str:
    slowest, fastest = speed_range_m_s(context.facts, asks_for(context.plan, step))
    if slowest <= speed_m_s <= fastest:
        return ""
    return f"{speed_m_s:g} m/s is outside the vehicle's range of {slowest:g} to {fastest:g} m/s"
