"""Distance, time and end of one item, by what carries the vehicle."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from app.domain.autopilot import Quantity, quantity
from app.domain.drop.consent import CONSENT_MARGIN_S
from app.domain.geo import LatLon
from app.domain.items import Approach, Jump
from app.domain.items.fields import Position
from app.domain.items.landing_pattern import landing_pattern
from app.domain.plan.compiler import (
    EMBEDDED_HOLD_S,
    PAUSE_S,
    bound_s,
    brakes_to_prepare,
    holds_apart,
    settle_s,
    stop_radius_m,
)
from app.domain.plan.document import Plan
from app.domain.plan.drops import DropUse
from app.domain.plan.walk import Step, cruise_speed_m_s
from app.domain.prediction import airship, path_return, return_to_launch, rotary, rover, vtol, wing
from app.domain.prediction.motion import Effort, FlightContext, MotionState, Point
from app.domain.prediction.path_return import LegPassage
from app.domain.prediction.rotary import takes_off_s
from app.domain.vehicle.state import FlightRegime, VehicleType

REST_S = 1.4
"""A supervised drop: from the stop radius to the order to release: at rest, calm, looked at ten times a second."""
COMES_TO_REST_S = 6.0
"""A rotary wing from the acceptance radius of a loiter to rest at its point (flown at 5 and 11 m/s)."""
OVERSHOOT_S = 3.5
"""It comes to the point faster than at a waypoint that brakes, and may have to return before it counts as at rest."""
SEEN_AT_HOLD_S = 0.8
"""A vehicle at rest enters the hold of a supervised drop: until it is seen there, once a second, and calm."""
ANSWER_S = 0.2
"""From the gripper's last ack to the next item."""


class Ahead(NamedTuple):
    """What follows an item: the next position item without a takeoff between, and all positions of the plan.

    `has_landed`: a landing comes before the item.
    """

    following: Point | None
    following_up_m: float
    positions: Callable[[], Sequence[LegPassage]]
    has_landed: bool = False


STOPS = Ahead(None, 0.0, tuple)


def effort(
    flight: FlightContext, before: MotionState, step: Step, speed_m_s: float, drop: DropUse | None, ahead: Ahead
) -> Effort:
    """`drop` is the item's own, or the one for which a waypoint brakes. The time of a supervised drop begins with the
    order to release, or with the question to the operator, and that of its waypoint ends with it.
    """
    if step.after is FlightRegime.ROTARY_WING:
        speed_m_s = vtol.hover_speed_m_s(flight.facts, speed_m_s)
    return step.item.effort(_StepPredictor(flight, before, step, speed_m_s, drop, ahead))


class _StepPredictor(NamedTuple):
    """How the vehicle covers one step: see Predictor."""

    flight: FlightContext
    before: MotionState
    step: Step
    speed_m_s: float
    use: DropUse | None
    ahead: Ahead

    def take_off(self) -> Effort:
        return _takeoff(self.flight, self.before, self.step, self.speed_m_s)

    def fly(self, hold_s: float, acceptance_radius_m: float | None) -> Effort:
        drop, step, flight = self.use, self.step, self.flight
        radius_m = acceptance_radius_m or quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)
        if drop is not None:
            radius_m = stop_radius_m(acceptance_radius_m)
        hovers = step.after is FlightRegime.ROTARY_WING and (drop is not None or hold_s > 0.0)
        leg = _leg(flight, self.before, step, self.speed_m_s, radius_m, self._nothing() if hovers else self.ahead)
        if not hovers:
            return leg
        if drop is not None and brakes_to_prepare(drop):
            hold_s = max(hold_s, PAUSE_S)
        elif drop is not None:
            hold_s = REST_S if drop.supervised else max(hold_s, EMBEDDED_HOLD_S)
        point = point_of(flight, step.end)
        return Effort(self.before.away_m(point), leg.duration_s + hold_s, leg.end.standing(point), leg.uncertainty_s)

    def circle(self, radius_m: float | None, seconds: float, turns: float | None) -> Effort:
        flight, step = self.flight, self.step
        if step.after is FlightRegime.FIXED_WING:
            wide_m = radius_m or quantity(flight.facts, Quantity.LOITER_RADIUS_M)
            seconds += (turns or 0.0) * math.tau * abs(wide_m) / max(0.1, self.speed_m_s)
            point, up_m = point_of(flight, step.end), step.end.relative_altitude_m
            return wing.circle(flight, self.before, point, up_m, wide_m, seconds, self.speed_m_s)
        reach_m = quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)
        leg = _leg(flight, self.before, step, self.speed_m_s, reach_m, self._nothing())
        end = leg.end if step.after is FlightRegime.BUOYANCY else _braked(leg.end, point_of(flight, step.end), seconds)
        return Effort(leg.distance_m, leg.duration_s + seconds, end)

    def land(self, touchdown: Position, approach: Approach | None) -> Effort:
        flight, before, step, speed_m_s = self.flight, self.before, self.step, self.speed_m_s
        if flight.facts.vehicle_type is VehicleType.FIXED_WING:
            pattern = landing_pattern(touchdown, approach, step.start, flight.home, flight.facts)
            return wing.land(flight, before, pattern, max(speed_m_s, 1.0))
        point, up_m = point_of(flight, step.end), step.end.relative_altitude_m
        if step.before is FlightRegime.WHEELS:
            return rover.drive(flight, before, point, None, speed_m_s)
        target = rotary.LegTarget(point, up_m, quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M))
        if step.before is FlightRegime.FIXED_WING:
            return vtol.land(flight, before, target, max(speed_m_s, 1.0), _hover_m_s(flight))
        return rotary.land(flight, before, target, max(speed_m_s, 0.1))

    def return_home(self) -> Effort:
        return _return(self.flight, self.before, self.step, self.speed_m_s, self.ahead)

    def turn_to(self, to: Literal["multicopter", "fixed_wing"]) -> Effort:
        if to == "fixed_wing":
            return vtol.to_wing(self.flight, self.before, self.ahead.following)
        return vtol.to_hover(self.flight, self.before)

    def wait(self, duration_s: float) -> Effort:
        return Effort(0.0, duration_s, _waited(self.before, self.step))

    def drop(self) -> Effort:
        return _drop(self.flight, self.before, self.step, self.use, self.speed_m_s)

    def at_once(self) -> Effort:
        return Effort(0.0, 0.0, self.before)

    def _nothing(self) -> Ahead:
        """Nothing follows where the vehicle stops: PX4 brakes for a hold in rotary-wing state."""
        return STOPS._replace(has_landed=self.ahead.has_landed)


def point_of(flight: FlightContext, place: LatLon) -> Point:
    """East and north of home."""
    return flight.to_local(place.latitude_deg, place.longitude_deg)


def _takeoff(flight: FlightContext, before: MotionState, step: Step, speed_m_s: float) -> Effort:
    point, up_m = point_of(flight, step.end), step.end.relative_altitude_m
    match flight.facts.vehicle_type:
        case VehicleType.FIXED_WING:
            return wing.take_off(flight, before, point, up_m, speed_m_s)
        case VehicleType.VTOL:
            return vtol.take_off(flight, before, point, up_m, speed_m_s)
        case VehicleType.AIRSHIP:
            return airship.take_off(flight, before, up_m)
        case VehicleType.MULTICOPTER | VehicleType.ROVER:
            target = rotary.LegTarget(point, up_m, quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M))
            return rotary.take_off(flight, before, target, speed_m_s)


def _leg(
    flight: FlightContext, before: MotionState, step: Step, speed_m_s: float, radius_m: float, ahead: Ahead
) -> Effort:
    """The flight to a waypoint or a loiter. A vehicle on the ground climbs first, at the start of the mission.

    After a landing within the mission, a hovering vehicle is still armed and climbs on its way [09_quad_land_deliver].
    """
    point, up_m = point_of(flight, step.end), step.end.relative_altitude_m
    match step.after:
        case FlightRegime.FIXED_WING:
            if step.before is FlightRegime.GROUND:
                climbed = wing.take_off(flight, before, point, _first_up_m(flight, before, up_m), speed_m_s)
                return _after(climbed, wing.fly(flight, climbed.end, point, up_m, speed_m_s))
            return wing.fly(flight, before, point, up_m, speed_m_s)
        case FlightRegime.WHEELS:
            return rover.drive(flight, before, point, ahead.following, speed_m_s)
        case FlightRegime.BUOYANCY:
            return airship.fly(flight, before, point, up_m, speed_m_s)
        case FlightRegime.ROTARY_WING | FlightRegime.GROUND:
            pass
    target = rotary.LegTarget(point, up_m, radius_m, ahead.following, ahead.following_up_m)
    if step.before is not FlightRegime.GROUND:
        return rotary.fly(flight, before, target, speed_m_s)
    if ahead.has_landed:
        leg = rotary.fly(flight, before, target, speed_m_s)
        lifted_s = takes_off_s(flight.facts, up_m - before.up_m) - quantity(flight.facts, Quantity.SPOOL_UP_S)
        return leg._replace(duration_s=max(leg.duration_s + quantity(flight.facts, Quantity.TAKEOFF_RAMP_S), lifted_s))
    up_first = rotary.LegTarget(before.point, _first_up_m(flight, before, up_m), radius_m)
    climbed = rotary.take_off(flight, before, up_first, speed_m_s)
    return _after(climbed, rotary.fly(flight, climbed.end, target, speed_m_s))


def _first_up_m(flight: FlightContext, before: MotionState, up_m: float) -> float:
    return max(up_m, before.up_m + quantity(flight.facts, Quantity.TAKEOFF_HEIGHT_M))


def _after(first: Effort, then: Effort) -> Effort:
    return Effort(
        first.distance_m + then.distance_m,
        first.duration_s + then.duration_s,
        then.end,
        then.uncertainty_s,
        first.climbed_m if then.climbed_m is None else then.climbed_m,
    )


def _return(flight: FlightContext, before: MotionState, step: Step, speed_m_s: float, ahead: Ahead) -> Effort:
    if return_to_launch.follows_mission(flight.facts):
        return path_return.fly(flight, before, step, ahead.positions(), speed_m_s)
    to = return_to_launch.destination(flight, before, lambda: path_return.landing_of(ahead.positions()))
    up_m = return_to_launch.return_up_m(flight, before, to, step.before)
    round_it, at = Effort(0.0, 0.0, before), before
    for corner, following in pairwise(return_to_launch.way_of(flight, before.point, to)):
        round_it = _after(round_it, _to_corner(flight, at, step, speed_m_s, corner, following, up_m))
        at = round_it.end
    home = _return_straight(flight, at, step, speed_m_s, to, up_m)
    return home if at is before else _after(round_it, home)


def _to_corner(
    flight: FlightContext, at: MotionState, step: Step, speed_m_s: float, corner: Point, following: Point, up_m: float
) -> Effort:
    """A leg of a return round the fence."""
    match step.before:
        case FlightRegime.WHEELS:
            return rover.drive(flight, at, corner, following, speed_m_s)
        case FlightRegime.BUOYANCY:
            return airship.fly(flight, at, corner, up_m, speed_m_s)
        case FlightRegime.FIXED_WING:
            return wing.fly(flight, at, corner, up_m, max(speed_m_s, 1.0))
        case FlightRegime.ROTARY_WING | FlightRegime.GROUND:
            target = rotary.LegTarget(
                corner, up_m, quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M), following, up_m
            )
            return rotary.fly(flight, at, target, max(speed_m_s, 0.1))


def _return_straight(
    flight: FlightContext, before: MotionState, step: Step, speed_m_s: float, to: Point, up_m: float
) -> Effort:
    if step.before is FlightRegime.WHEELS:
        return rover.drive(flight, before, to, None, speed_m_s)
    if step.before is FlightRegime.BUOYANCY:
        return airship.fly(flight, before, to, up_m, speed_m_s)
    climbed_m = max(0.0, up_m - before.up_m)
    if step.before is not FlightRegime.FIXED_WING:
        return rotary.return_home(flight, before, to, up_m, max(speed_m_s, 0.1))._replace(climbed_m=climbed_m)
    climbing_s = wing.climb_s(
        flight.facts, max(0.0, up_m - before.up_m - quantity(flight.facts, Quantity.WING_ALTITUDE_RADIUS_M))
    )
    climbed = Effort(climbing_s * speed_m_s, climbing_s, MotionState(before.point, up_m), climbed_m=climbed_m)
    home = _after(climbed, wing.fly(flight, climbed.end, to, up_m, max(speed_m_s, 1.0)))
    if flight.facts.vehicle_type is not VehicleType.VTOL:
        return home  # it circles there
    hovering = _after(home, vtol.to_hover(flight, home.end))
    target = rotary.LegTarget(to, 0.0, quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M))
    return _after(hovering, rotary.land(flight, hovering.end, target, _hover_m_s(flight)))


def _hover_m_s(flight: FlightContext) -> float:
    return max(0.1, cruise_speed_m_s(flight.facts, FlightRegime.ROTARY_WING))


def _waited(before: MotionState, step: Step) -> MotionState:
    """A rover, or a vehicle that hovers, has come to rest at its point while it waited."""
    return (
        before.standing()
        if step.after in (FlightRegime.WHEELS, FlightRegime.ROTARY_WING, FlightRegime.GROUND)
        else before
    )


def _braked(moving: MotionState, point: Point, seconds: float) -> MotionState:
    """The motion of a rotary wing that slows down at an even rate for so long, on its way to rest at a point."""
    left = 1.0 - seconds / COMES_TO_REST_S
    if left <= 0.0 or moving.speed_m_s <= 0.0:
        return moving.standing(point)
    there = (
        point[0] + left**2 * (moving.point[0] - point[0]),
        point[1] + left**2 * (moving.point[1] - point[1]),
    )
    return moving._replace(point=there, speed_m_s=left * moving.speed_m_s)


def _drop(flight: FlightContext, before: MotionState, step: Step, drop: DropUse | None, speed_m_s: float) -> Effort:
    """A drop's own time: none for one in passing."""
    if drop is None or not drop.stopped:
        return Effort(0.0, 0.0, before)
    stopped = _stop_for(flight, before, drop, speed_m_s)
    if not drop.supervised:
        return stopped._replace(duration_s=stopped.duration_s + settle_s(drop.item, flight.facts))
    question_s = _longest_question_s(drop)
    rest_s = REST_S if drop.carried is FlightRegime.WHEELS else 0.0
    seconds = stopped.duration_s + rest_s + quantity(flight.facts, Quantity.GRIPPER_S) + ANSWER_S + question_s
    uncertainty_s = stopped.uncertainty_s + question_s  # the acknowledgement may come at once
    return stopped._replace(duration_s=seconds, uncertainty_s=uncertainty_s)


def _stop_for(flight: FlightContext, before: MotionState, drop: DropUse, speed_m_s: float) -> Effort:
    """From the end of the item before to rest, where the vehicle stops at a waypoint of the drop's own."""
    if drop.anchor is None or not holds_apart(drop):
        return Effort(0.0, 0.0, before.standing())
    hold_s = 0.0 if drop.supervised or not drop.first else EMBEDDED_HOLD_S
    if before.speed_m_s <= 0.0:
        return Effort(0.0, SEEN_AT_HOLD_S if drop.supervised else hold_s, before.standing())
    point, up_m = point_of(flight, drop.anchor.end), drop.anchor.end.relative_altitude_m
    way = rotary.fly(
        flight, before, rotary.LegTarget(point, up_m, stop_radius_m(drop.anchor.item.reach_m())), speed_m_s
    )
    hold_s += REST_S if drop.supervised else 0.0
    return Effort(before.away_m(point), way.duration_s + hold_s, before.standing(point, up_m), OVERSHOOT_S)


def _longest_question_s(drop: DropUse) -> float:
    """An operator may take this long to consent; limits and batteries must bear the longest answer."""
    if drop.item.consent == "none":
        return 0.0
    return min(drop.item.consent_timeout_s or math.inf, max(0.0, bound_s(drop) - CONSENT_MARGIN_S))


MAX_VISITS = 5000
"""Nested jumps can ask for millions; nobody flies or draws those."""


@dataclass(frozen=True, slots=True)
class FlownOrder:
    """Indexes of items, jumps left out. `open_ended`: stops at a loiter that never ends."""

    indexes: tuple[int, ...]
    open_ended: bool
    truncated: bool


def flown_order(plan: Plan) -> FlownOrder:
    """Each jump goes back `repeats` times in the whole mission: PX4 does not reset its counter in a nested loop."""
    index_of = {item.id: index for index, item in enumerate(plan.items)}
    left = {item.id: item.repeats for item in plan.items if isinstance(item, Jump)}
    visited: list[int] = []
    index = 0
    while index < len(plan.items):
        item = plan.items[index]
        if len(visited) >= MAX_VISITS:
            return FlownOrder(tuple(visited), open_ended=False, truncated=True)
        if isinstance(item, Jump):
            if left[item.id] > 0 and item.target in index_of:
                left[item.id] -= 1
                index = index_of[item.target]
            else:
                index += 1
            continue
        visited.append(index)
        if item.goes_home or item.never_ends():
            return FlownOrder(tuple(visited), open_ended=item.never_ends(), truncated=False)
        index += 1
    return FlownOrder(tuple(visited), open_ended=False, truncated=False)
