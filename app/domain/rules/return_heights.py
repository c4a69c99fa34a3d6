"""Rules for how high a return flies and for rally points: no item of the plan has these positions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from app.domain.autopilot import Quantity
from app.domain.geo import LatLon
from app.domain.items.fields import relative_altitude_m
from app.domain.prediction.motion import FlightContext, MotionState
from app.domain.prediction.path_return import positions_of, return_ends
from app.domain.prediction.return_to_launch import follows_mission, return_up_m
from app.domain.rules.places import from_home_m
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.validation.finding import json_pointer
from app.domain.vehicle.state import FlightRegime

rules = RuleSet()
_AIRBORNE = (FlightRegime.ROTARY_WING, FlightRegime.FIXED_WING, FlightRegime.BUOYANCY)
_ON_FAILURE = json_pointer("contingency", "on_drop_failure")


@dataclass(frozen=True, slots=True)
class _Most:
    """A limit of heights. `whose` is the limit of the message, `remedy` ends the hint."""

    height_m: float
    whose: str
    remedy: str


@rules.error(
    "limits.return_altitude",
    "A return climbs to the vehicle's return altitude first, above home or above the rally point that it goes to.",
    "`limits` of the plan; PX4 RTL_RETURN_ALT.",
)
def _own_return(context: RuleContext) -> Iterator[Violation]:
    if (most := _of_plan(context)) is not None:
        yield from _ordered_above(context, most)


@rules.warning(
    "limits.failsafe_altitude",
    "An operator, a pilot or a failsafe may command a return from anywhere. It climbs to the return altitude first.",
    "`limits` of the plan; PX4 RTL_RETURN_ALT.",
)
def _own_failsafe(context: RuleContext) -> Iterator[Violation]:
    if (most := _of_plan(context)) is not None:
        yield from _failsafe_above(context, most, json_pointer("limits", "max_relative_altitude_m"))


@rules.error(
    "geofence.return_height",
    "A return climbs to the vehicle's return altitude first, and may leave the vehicle's own geofence.",
    "PX4 RTL_RETURN_ALT, GF_MAX_VER_DIST.",
)
def _vehicle_return(context: RuleContext) -> Iterator[Violation]:
    if (most := _of_vehicle(context)) is not None:
        yield from _ordered_above(context, most)


@rules.warning(
    "geofence.failsafe_height",
    "An operator, a pilot or a failsafe may command a return from anywhere, which leaves the vehicle's own geofence.",
    "PX4 RTL_RETURN_ALT, GF_MAX_VER_DIST.",
)
def _vehicle_failsafe(context: RuleContext) -> Iterator[Violation]:
    if (most := _of_vehicle(context)) is not None:
        yield from _failsafe_above(context, most, "")


@rules.error("limits.rally_point", "No rally point may be beyond the plan's limits.", "`limits` of the plan.")
def _own_rally(context: RuleContext) -> Iterator[Violation]:
    limits = context.plan.limits
    yield from _rally_beyond(context, limits.max_distance_m, limits.max_relative_altitude_m, "the limit of the plan")


@rules.error(
    "geofence.vehicle_rally",
    "No rally point may be beyond the geofence that the vehicle has of its own.",
    "PX4 GF_MAX_HOR_DIST, GF_MAX_VER_DIST.",
)
def _vehicle_rally(context: RuleContext) -> Iterator[Violation]:
    if context.plan.rally_points:
        far_m, high_m = (context.behaviour.quantity(one) for one in (Quantity.FARTHEST_M, Quantity.HIGHEST_M))
        yield from _rally_beyond(context, far_m or None, high_m or None, "the limit of the vehicle")


def _rally_beyond(context: RuleContext, far_m: float | None, high_m: float | None, whose: str) -> Iterator[Violation]:
    for index, point in enumerate(context.plan.rally_points):
        away_m = from_home_m(context, LatLon(point.latitude_deg, point.longitude_deg, 0.0))
        up_m = relative_altitude_m(point, context.home) if context.knows_height(point) else None
        message = ""
        if far_m is not None and away_m > far_m:
            message = f"{away_m:.0f} m from home; {whose} is {far_m:g} m"
        elif high_m is not None and up_m is not None and up_m > high_m:
            message = f"{up_m:g} m above home; {whose} is {high_m:g} m"
        if message:
            yield Violation(json_pointer("rally_points", index), message, "move the rally point, or raise the limit")


def _of_plan(context: RuleContext) -> _Most | None:
    most_m = context.plan.limits.max_relative_altitude_m
    return None if most_m is None else _Most(most_m, "the limit of the plan", "raise limits.max_relative_altitude_m")


def _of_vehicle(context: RuleContext) -> _Most | None:
    most_m, name = context.behaviour.quantity(Quantity.HIGHEST_M), context.behaviour.name_of(Quantity.HIGHEST_M)
    return _Most(most_m, f"the limit of the vehicle ({name})", f"raise {name}") if most_m > 0 else None


def _ordered_above(context: RuleContext, most: _Most) -> Iterator[Violation]:
    """Returns that the plan orders: by an item, or after a failed drop."""
    returns = _Returns(context)
    for step in context.steps:
        if step.item.goes_home and (up_m := returns.up_m(step.start, step.before, step.index)) > most.height_m:
            yield at_item(step, *_said(context, "the return", up_m, most))
    if context.plan.contingency.on_drop_failure == "return":
        drops = [drop for drop in context.drops if drop.releases]
        heights = [returns.up_m(drop.step.start, drop.carried, drop.step.index) for drop in drops]
        if (up_m := max(heights, default=0.0)) > most.height_m:
            yield Violation(_ON_FAILURE, *_said(context, "the return after a failed drop", up_m, most))


def _failsafe_above(context: RuleContext, most: _Most, pointer: str) -> Iterator[Violation]:
    if any(_ordered_above(context, most)):
        return
    returns = _Returns(context)
    heights = [returns.up_m(step.end, step.after, step.index) for step in context.steps]
    if (up_m := max(heights, default=0.0)) > most.height_m:
        yield Violation(pointer, *_said(context, "a return that is commanded on the way", up_m, most))


def _said(context: RuleContext, what: str, up_m: float, most: _Most) -> tuple[str, str]:
    """Message and hint."""
    name = context.behaviour.name_of(Quantity.RETURN_HEIGHT_M)
    message = f"{what} climbs to {up_m:.0f} m above home ({name}); {most.whose} is {most.height_m:g} m"
    return message, f"lower {name}, or {most.remedy}"


class _Returns:
    """Returns from the places of a plan."""

    def __init__(self, context: RuleContext) -> None:
        facts, home = context.behaviour.usable(), context.origin
        flight = FlightContext(facts, home)
        self._to_up_m = {
            flight.to_local(point.latitude_deg, point.longitude_deg): relative_altitude_m(point, home)
            if context.knows_height(point)
            else 0.0
            for point in context.plan.rally_points
        }
        self._flight = FlightContext(facts, home, rally_points=tuple(self._to_up_m))
        self._positions = positions_of(self._flight, context.plan)
        self._climbs = not follows_mission(facts)

    def up_m(self, here: LatLon, carried: FlightRegime, index: int) -> float:
        """How high a return from there climbs; 0 if it does not climb."""
        if carried not in _AIRBORNE or not self._climbs:
            return 0.0
        flight, point = self._flight, self._flight.to_local(here.latitude_deg, here.longitude_deg)
        motion = MotionState(point, here.relative_altitude_m)
        ends = return_ends(flight, point, self._positions, index)
        heights = [return_up_m(flight, motion, end, carried, self._to_up_m.get(end, 0.0)) for end in ends]
        up_m = max(heights, default=0.0)
        return up_m if up_m > here.relative_altitude_m else 0.0
