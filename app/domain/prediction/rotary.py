"""A hovering vehicle: takeoff, legs, landing and return, by PX4's smoothed trajectories.

Constants are from recorded PX4 flights (SITL): wind changes little but for a vehicle at the end of its thrust.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from app.domain.autopilot import Quantity, quantity
from app.domain.plan.walk import Step, cruise_speed_m_s, speed_range_m_s
from app.domain.prediction.motion import Effort, FlightContext, MotionState, Point, ahead, course, turn
from app.domain.vehicle.state import FlightRegime, VehicleProfile, VehicleType

# The time along PX4's smoothed trajectories: jerk-limited acceleration, and deceleration by distance.
#
# Source: PX4 VelocitySmoothing (starts) and computeMaxSpeedFromDistance, computeMaxSpeedInWaypoint (slow-downs).


SHORTEST_M = 0.05
_HALVINGS = 30


@dataclass(slots=True)
class TrajectoryLimits:
    """Of one axis of a trajectory. Not frozen: each leg makes one, and a frozen dataclass takes three times as long."""

    speed_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float
    _b: float = field(init=False)

    def __post_init__(self) -> None:
        self._b = 4.0 * self.acceleration_m_s2**2 / self.jerk_m_s3

    def start_s(self, gained_m_s: float) -> float:
        """Time to gain so much speed: the acceleration grows, stays, and falls again."""
        acceleration, jerk = self.acceleration_m_s2, self.jerk_m_s3
        if gained_m_s <= 0.0:
            return 0.0
        if gained_m_s < acceleration**2 / jerk:
            return 2.0 * math.sqrt(gained_m_s / jerk)
        return gained_m_s / acceleration + acceleration / jerk

    def speed_at_m_s(self, distance_m: float, final_m_s: float = 0.0) -> float:
        """The fastest that PX4 goes so far before a point that it is to pass with `final_m_s`."""
        under_root = self._b**2 + 8.0 * self.acceleration_m_s2 * max(0.0, distance_m) + 4.0 * final_m_s**2
        return max(0.5 * (-self._b + math.sqrt(under_root)), final_m_s)

    def slow_down_m(self, speed_m_s: float, final_m_s: float = 0.0) -> float:
        """How far before the point it begins to slow down."""
        if speed_m_s <= final_m_s:
            return 0.0
        return (speed_m_s**2 + self._b * speed_m_s - final_m_s**2) / (2.0 * self.acceleration_m_s2)

    def slow_down_s(self, speed_m_s: float, to_m: float, final_m_s: float = 0.0) -> float:
        """From the beginning of the slow-down until `to_m` before the point."""
        begin_m = self.slow_down_m(speed_m_s, final_m_s)
        if begin_m <= to_m:
            return 0.0
        there_m_s = max(self.speed_at_m_s(max(to_m, SHORTEST_M), final_m_s), 1e-3)
        lost = 2.0 * (speed_m_s - there_m_s) + self._b * math.log(max(speed_m_s, there_m_s) / there_m_s)
        crawl_m = max(0.0, self._b * final_m_s / (2.0 * self.acceleration_m_s2) - to_m) if final_m_s > 0.0 else 0.0
        return lost / (2.0 * self.acceleration_m_s2) + (crawl_m / final_m_s if crawl_m > 0.0 else 0.0)


def travel_s(
    way_m: float, limits: TrajectoryLimits, *, start_m_s: float = 0.0, end_m: float = 0.0, final_m_s: float = 0.0
) -> float:
    """Time from the start until `end_m` before the end of a straight way that ends with `final_m_s`."""
    if way_m <= end_m:
        return 0.0
    top_m_s = limits.speed_m_s
    start_s, level_m = _level_m(way_m, limits, top_m_s, start_m_s, end_m, final_m_s)
    if level_m < 0.0:  # a short distance: this speed is not reached
        top_m_s = _top_m_s(way_m, limits, start_m_s, end_m, final_m_s)
        start_s, level_m = _level_m(way_m, limits, top_m_s, start_m_s, end_m, final_m_s)
    return start_s + max(0.0, level_m) / max(top_m_s, 0.05) + limits.slow_down_s(top_m_s, end_m, final_m_s)


def _level_m(
    way_m: float, limits: TrajectoryLimits, top_m_s: float, start_m_s: float, end_m: float, final_m_s: float
) -> tuple[float, float]:
    """Seconds of the start, and the way between it and the slow-down; below 0: it is not long enough for both."""
    start_s = limits.start_s(top_m_s - start_m_s)
    start_m = (start_m_s + top_m_s) / 2.0 * start_s
    return start_s, way_m - (start_m + max(limits.slow_down_m(top_m_s, final_m_s), end_m))


def _top_m_s(way_m: float, limits: TrajectoryLimits, start_m_s: float, end_m: float, final_m_s: float) -> float:
    """The maximum speed on a short distance."""
    low, high = min(max(start_m_s, final_m_s, 0.05), limits.speed_m_s), limits.speed_m_s
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        _, level_m = _level_m(way_m, limits, middle, start_m_s, end_m, final_m_s)
        low, high = (middle, high) if level_m >= 0.0 else (low, middle)
    return low


def speed_in_turn_m_s(turn_rad: float, acceleration_m_s2: float, radius_m: float) -> float:
    """How fast a corner is passed; `turn_rad` is 0 straight on, pi straight back."""
    if turn_rad < 1e-3:
        return math.inf
    return math.sqrt(acceleration_m_s2 * radius_m * math.tan(max(0.0, (math.pi - turn_rad) / 2.0)))


ALTITUDE_TOLERANCE_M = 0.8
"""NAV_MC_ALT_RAD: an altitude counts as reached this much before it."""
LAG_M = 0.5
"""Of the vehicle behind its trajectory: it comes in faster than the trajectory slows down."""
CRAWL_M, CRAWL_M_S = 0.6, 0.3
"""The last of a landing with a range sensor (MPC_LAND_CRWL)."""
DETECTED_S = 1.8
"""From touching the ground to "landed": the thrust has to fall, then LNDMC_TRIG_TIME."""
VTOL_RAMP_SHARE = 0.6
"""The lift motors of a VTOL are strong: it leaves the ground before the ramp is over (recorded)."""
_SLOWEST_M_S = 0.1


def climb_s(facts: VehicleProfile, height_m: float) -> float:
    """Seconds for a change of altitude while hovering, up (+) or down (-), until it counts as reached."""
    if abs(height_m) <= ALTITUDE_TOLERANCE_M:
        return 0.0
    up = height_m > 0
    speed = quantity(facts, Quantity.CLIMB_M_S if up else Quantity.SINK_M_S)
    acceleration = quantity(facts, Quantity.CLIMB_ACCELERATION_M_S2 if up else Quantity.SINK_ACCELERATION_M_S2)
    return _rise_s(facts, abs(height_m), speed, acceleration)


def takes_off_s(facts: VehicleProfile, height_m: float) -> float:
    """Spool up, the thrust ramp, slowly at first, then as any climb."""
    ramp_s, slow_m_s = (
        quantity(facts, Quantity.TAKEOFF_RAMP_S),
        max(quantity(facts, Quantity.TAKEOFF_M_S), _SLOWEST_M_S),
    )
    share = VTOL_RAMP_SHARE if facts.vehicle_type is VehicleType.VTOL else 1.0
    on_ground_s = quantity(facts, Quantity.SPOOL_UP_S) + ramp_s * share
    slow_below_m = quantity(facts, Quantity.LANDING_SLOWS_BELOW_M)
    if height_m <= slow_below_m + ALTITUDE_TOLERANCE_M:
        return on_ground_s + ramp_s / 2.0 + max(0.0, height_m - ALTITUDE_TOLERANCE_M) / slow_m_s
    below_s = ramp_s / 2.0 + slow_below_m / slow_m_s
    fast = quantity(facts, Quantity.CLIMB_M_S)
    above_s = _rise_s(
        facts, height_m - slow_below_m, fast, quantity(facts, Quantity.CLIMB_ACCELERATION_M_S2), min(slow_m_s, fast)
    )
    return on_ground_s + below_s + above_s


def lands_vertically_s(facts: VehicleProfile, height_m: float, above_ground_m: float) -> float:
    """Full speed, then slower and slower, the landing speed, the crawl, the detection."""
    fast = max(quantity(facts, Quantity.SINK_M_S), _SLOWEST_M_S)
    slow = max(quantity(facts, Quantity.LANDING_M_S), _SLOWEST_M_S)
    lower = quantity(facts, Quantity.LANDING_SLOW_BELOW_M)
    upper = max(quantity(facts, Quantity.LANDING_SLOWS_BELOW_M), lower)
    height = max(0.0, min(height_m, above_ground_m))
    start_s = fast / max(quantity(facts, Quantity.SINK_ACCELERATION_M_S2), 0.5)
    seconds = start_s / 2.0 + max(0.0, height - upper) / fast
    between_m = max(0.0, min(height, upper) - lower)
    if between_m > 0.0 and upper > lower:
        there = slow + between_m / (upper - lower) * (fast - slow)
        mean = (there - slow) / math.log(there / slow) if there > slow * 1.001 else slow
        seconds += between_m / mean
    seconds += max(0.0, min(height, lower) - CRAWL_M) / slow
    return seconds + min(height, CRAWL_M) / min(CRAWL_M_S, slow) + DETECTED_S


def _rise_s(
    facts: VehicleProfile, way_m: float, speed_m_s: float, acceleration: float, start_m_s: float = 0.0
) -> float:
    if way_m <= ALTITUDE_TOLERANCE_M:
        return 0.0
    jerk = max(quantity(facts, Quantity.HOVER_JERK_M_S3), 0.5)
    limits = TrajectoryLimits(max(speed_m_s, _SLOWEST_M_S), max(acceleration, 0.1), jerk)
    end_m = ALTITUDE_TOLERANCE_M + LAG_M
    return travel_s(way_m + LAG_M, limits, start_m_s=start_m_s, end_m=end_m)


LAG_S = 0.43
"""The vehicle follows its trajectory this late, and so comes in faster than the trajectory slows down."""
CREEP_SHARE = 0.22
CREEP_S = 7.5
"""It rises to 78 % of its cruise speed quickly and creeps up to the rest: of 5 m/s 3.9 after 10 m, 4.6 after 40."""
BOBBING_S = 1.9
BOBBING_UNSURE_S = 3.0
"""Before a change of height PX4 does not keep the altitude of a waypoint that it flies through (recorded): it goes up
and down by a metre or two with a period of six seconds, so the altitude counts as reached up to 5 s late. Which moment
it is cannot be predicted. By then the vehicle is at the point or beyond, and starts anew, perhaps at its new height.
"""
TURN_S = 1.2
"""It swings out of a turn straight back by so much; half of it in a right angle."""
STOP_S = 1.2
"""A return begins with coming to rest where it is."""


def wind_load(facts: VehicleProfile, wind_m_s: float, speed_m_s: float) -> float:
    """Above 1 a hovering vehicle may not keep its speed against the wind.

    No parameter names its highest airspeed: it is known to reach its cruise speed, and meant to reach its fastest.
    """
    cruise_m_s = cruise_speed_m_s(facts, FlightRegime.ROTARY_WING)
    _, fastest_m_s = speed_range_m_s(facts, FlightRegime.ROTARY_WING)
    return max(wind_m_s / cruise_m_s, (wind_m_s + speed_m_s) / fastest_m_s)


def wind_uncertainty_s(flight: FlightContext, step: Step, took: Effort, speed_m_s: float) -> float:
    """Of a leg in strong wind. Simulated quads fly legs of 25 s at 7 m/s up to 14 s slower, at 8 m/s up to 30 s."""
    wind_m_s = flight.wind.speed_m_s
    if wind_m_s == 0.0 or FlightRegime.ROTARY_WING not in (step.before, step.after):
        return 0.0
    load = wind_load(flight.facts, wind_m_s, speed_m_s)
    return took.duration_s * load**2 if load > 1.0 else 0.0


class LegTarget(NamedTuple):
    """Where a leg goes. `following` is the position item after it; None: it stops there."""

    point: Point
    up_m: float
    radius_m: float
    following: Point | None = None
    following_up_m: float = 0.0


def fly(flight: FlightContext, before: MotionState, target: LegTarget, speed_m_s: float) -> Effort:
    """A leg: over when the target is inside the acceptance radius and at its altitude."""
    away_m = before.away_m(target.point)
    if away_m <= target.radius_m:
        return Effort(away_m, climb_s(flight.facts, target.up_m - before.up_m), before._replace(up_m=target.up_m))
    course_rad, flies_m_s = course(before.point, target.point), max(speed_m_s, 0.1)
    hover = flight.hover
    limits = TrajectoryLimits(flies_m_s, hover.acceleration_m_s2, hover.jerk_m_s3)
    final_m_s = _final_m_s(hover.corner_m_s2, course_rad, target, flies_m_s)
    level_s = _level_s(before, target, limits, course_rad, final_m_s)
    rise_s = climb_s(flight.facts, target.up_m - before.up_m)
    end_m_s = min(speed_m_s, limits.speed_at_m_s(_seen_m(target, flies_m_s), final_m_s))
    arrived = _arrived(target, course_rad, end_m_s)
    if rise_s > level_s:  # it waits at the point for its altitude
        return Effort(away_m, rise_s, arrived.standing(target.point))
    if target.following is not None and abs(target.following_up_m - target.up_m) > ALTITUDE_TOLERANCE_M:
        return Effort(away_m, level_s + BOBBING_S, arrived.standing(target.point), BOBBING_UNSURE_S)
    return Effort(before.away_m(arrived.point), level_s, arrived)


def take_off(flight: FlightContext, before: MotionState, target: LegTarget, speed_m_s: float) -> Effort:
    """Spin up, straight up; then, if the takeoff has a place, to it."""
    up_s = takes_off_s(flight.facts, target.up_m - before.up_m)
    above = before.standing(up_m=target.up_m)
    if above.away_m(target.point) <= target.radius_m:
        return Effort(above.away_m(target.point), up_s, above)
    leg = fly(flight, above, target, speed_m_s)
    return Effort(leg.distance_m, up_s + leg.duration_s, leg.end)


def land(flight: FlightContext, before: MotionState, target: LegTarget, speed_m_s: float) -> Effort:
    """To the point at this height; inside the radius the descent begins. A landing is over when it is detected."""
    height_m = max(before.up_m, target.up_m)
    away_m = before.away_m(target.point)
    to_s = fly(flight, before, LegTarget(target.point, height_m, target.radius_m), speed_m_s).duration_s
    down_s = lands_vertically_s(flight.facts, height_m - target.up_m, height_m)
    return Effort(away_m, to_s + down_s, before.standing(target.point, target.up_m))


def return_home(flight: FlightContext, before: MotionState, to: Point, return_up_m: float, speed_m_s: float) -> Effort:
    """RTL: stop, climb, fly back, land."""
    rise_m = return_up_m - before.up_m
    up_s = climb_s(flight.facts, rise_m) if rise_m > ALTITUDE_TOLERANCE_M else 0.0
    stop_s = STOP_S if before.speed_m_s > 1.0 and up_s == 0.0 else 0.0
    above = before.standing(up_m=return_up_m)
    landing = land(flight, above, LegTarget(to, 0.0, quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)), speed_m_s)
    return Effort(landing.distance_m, up_s + stop_s + landing.duration_s, landing.end)


def _arrived(target: LegTarget, course_rad: float, speed_m_s: float) -> MotionState:
    """At the edge of the acceptance radius."""
    there = ahead(target.point, course_rad + math.pi, target.radius_m)
    return MotionState(there, target.up_m, speed_m_s, course_rad if speed_m_s > 0.0 else None, course_rad)


def _level_s(
    before: MotionState, target: LegTarget, limits: TrajectoryLimits, course_rad: float, final_m_s: float
) -> float:
    speed_m_s, end_m = limits.speed_m_s, _seen_m(target, limits.speed_m_s)
    turn_rad = 0.0 if before.course_rad is None else turn(before.course_rad, course_rad)
    along_m_s = before.speed_m_s * math.cos(turn_rad)
    back_s = _back_s(limits, -along_m_s) if along_m_s < 0.0 else 0.0
    start_m_s = min(max(along_m_s, 0.0), speed_m_s)
    way_m = before.away_m(target.point) + end_m - target.radius_m
    moving_s = travel_s(way_m, limits, start_m_s=start_m_s, end_m=end_m, final_m_s=final_m_s)
    gained = (speed_m_s - start_m_s) / speed_m_s
    creep_s = CREEP_SHARE * CREEP_S * (1.0 - math.exp(-moving_s / CREEP_S)) * gained
    turn_s = TURN_S * math.sin(turn_rad / 2.0) ** 2 if before.speed_m_s > 0.0 else 0.0
    return back_s + moving_s + creep_s + turn_s + LAG_S * (gained > 0.1)


def _back_s(limits: TrajectoryLimits, away_m_s: float) -> float:
    """How much longer a start takes that first has to turn back: one sweep from the one speed to the other."""
    top_m_s = limits.speed_m_s
    sweep_s, start_s = limits.start_s(away_m_s + top_m_s), limits.start_s(top_m_s)
    return sweep_s - (top_m_s - away_m_s) / 2.0 * sweep_s / top_m_s - start_s / 2.0


def _seen_m(target: LegTarget, speed_m_s: float) -> float:
    """Where on its slow-down the trajectory is when the vehicle is at the radius."""
    return target.radius_m + LAG_S * speed_m_s


def _final_m_s(corner_m_s2: float, course_rad: float, target: LegTarget, speed_m_s: float) -> float:
    """Through a corner as fast as it may; 0 where it stops."""
    if target.following is None or math.dist(target.point, target.following) < target.radius_m:
        return 0.0
    turns_rad = turn(course_rad, course(target.point, target.following))
    return min(speed_m_s, speed_in_turn_m_s(turns_rad, corner_m_s2, target.radius_m))
