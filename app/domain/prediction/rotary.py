"""A hovering vehicle: takeoff, legs, landing and return, by PX4's smoothed trajectories. See smooth_speed.py.

Constants are from recorded PX4 flights (SITL): wind changes little but for a vehicle at the end of its thrust.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from app.domain.autopilot import Quantity, quantity
from app.domain.prediction.effort import Effort, Flight
from app.domain.prediction.motion import Motion, Point, turn
from app.domain.prediction.smooth_speed import Limits, speed_in_turn_m_s, travel_s
from app.domain.prediction.vertical import ALTITUDE_TOLERANCE_M, climb_s, lands_vertically_s, takes_off_s

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


@dataclass(frozen=True, slots=True)
class Target:
    """Where a leg goes. `following` is the position item after it; None: it stops there."""

    point: Point
    up_m: float
    radius_m: float
    following: Point | None = None
    following_up_m: float = 0.0


def fly(flight: Flight, before: Motion, target: Target, speed_m_s: float) -> Effort:
    """A leg: over when the target is inside the acceptance radius and at its altitude."""
    away_m = before.away_m(target.point)
    if away_m <= target.radius_m:
        return Effort(away_m, climb_s(flight.facts, target.up_m - before.up_m), replace(before, up_m=target.up_m))
    level_s = _level_s(flight, before, target, max(speed_m_s, 0.1))
    rise_s = climb_s(flight.facts, target.up_m - before.up_m)
    end_m_s = _speed_there_m_s(flight, before, target, speed_m_s)
    arrived = before.arrived(target.point, target.radius_m, target.up_m, end_m_s)
    if rise_s > level_s:  # it waits at the point for its altitude
        return Effort(away_m, rise_s, arrived.standing(target.point))
    if target.following is not None and abs(target.following_up_m - target.up_m) > ALTITUDE_TOLERANCE_M:
        return Effort(away_m, level_s + BOBBING_S, arrived.standing(target.point), BOBBING_UNSURE_S)
    return Effort(before.away_m(arrived.point), level_s, arrived)


def take_off(flight: Flight, before: Motion, target: Target, speed_m_s: float) -> Effort:
    """Spin up, straight up; then, if the takeoff has a place, to it."""
    up_s = takes_off_s(flight.facts, target.up_m - before.up_m)
    above = before.standing(up_m=target.up_m)
    if above.away_m(target.point) <= target.radius_m:
        return Effort(above.away_m(target.point), up_s, above)
    leg = fly(flight, above, target, speed_m_s)
    return Effort(leg.distance_m, up_s + leg.duration_s, leg.end)


def land(flight: Flight, before: Motion, target: Target, speed_m_s: float) -> Effort:
    """To the point at this height; inside the radius the descent begins. A landing is over when it is detected."""
    height_m = max(before.up_m, target.up_m)
    away_m = before.away_m(target.point)
    to_s = fly(flight, before, Target(target.point, height_m, target.radius_m), speed_m_s).duration_s
    down_s = lands_vertically_s(flight.facts, height_m - target.up_m, height_m)
    return Effort(away_m, to_s + down_s, before.standing(target.point, target.up_m))


def return_home(flight: Flight, before: Motion, to: Point, return_up_m: float, speed_m_s: float) -> Effort:
    """RTL: come to rest, climb, fly back, land."""
    rise_m = return_up_m - before.up_m
    up_s = climb_s(flight.facts, rise_m) if rise_m > ALTITUDE_TOLERANCE_M else 0.0
    stop_s = STOP_S if before.speed_m_s > 1.0 and up_s == 0.0 else 0.0
    above = before.standing(up_m=return_up_m)
    landing = land(flight, above, Target(to, 0.0, quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)), speed_m_s)
    return Effort(landing.distance_m, up_s + stop_s + landing.duration_s, landing.end)


def _level_s(flight: Flight, before: Motion, target: Target, speed_m_s: float) -> float:
    way_m = before.away_m(target.point)
    along_m_s = before.speed_m_s * math.cos(before.turn_to(target.point))
    limits, end_m = _limits(flight, speed_m_s), _seen_m(target, speed_m_s)
    back_s = _back_s(limits, -along_m_s) if along_m_s < 0.0 else 0.0
    final_m_s = _final_m_s(flight, before, target, speed_m_s)
    start_m_s = min(max(along_m_s, 0.0), speed_m_s)
    moving_s = travel_s(way_m + end_m - target.radius_m, limits, start_m_s=start_m_s, end_m=end_m, final_m_s=final_m_s)
    gained = (speed_m_s - start_m_s) / speed_m_s
    creep_s = CREEP_SHARE * CREEP_S * (1.0 - math.exp(-moving_s / CREEP_S)) * gained
    turn_s = TURN_S * math.sin(before.turn_to(target.point) / 2.0) ** 2 if before.speed_m_s > 0.0 else 0.0
    return back_s + moving_s + creep_s + turn_s + LAG_S * (gained > 0.1)


def _speed_there_m_s(flight: Flight, before: Motion, target: Target, speed_m_s: float) -> float:
    final_m_s = _final_m_s(flight, before, target, speed_m_s)
    return min(speed_m_s, _limits(flight, speed_m_s).speed_at_m_s(_seen_m(target, speed_m_s), final_m_s))


def _back_s(limits: Limits, away_m_s: float) -> float:
    """How much longer a start takes that first has to turn back: one sweep from the one speed to the other."""
    top_m_s = limits.speed_m_s
    sweep_s, start_s = limits.start_s(away_m_s + top_m_s), limits.start_s(top_m_s)
    return sweep_s - (top_m_s - away_m_s) / 2.0 * sweep_s / top_m_s - start_s / 2.0


def _seen_m(target: Target, speed_m_s: float) -> float:
    """Where on its slow-down the trajectory is when the vehicle is at the radius."""
    return target.radius_m + LAG_S * speed_m_s


def _final_m_s(flight: Flight, before: Motion, target: Target, speed_m_s: float) -> float:
    """Through a corner as fast as it may; 0 where it stops."""
    if target.following is None or math.dist(target.point, target.following) < target.radius_m:
        return 0.0
    turns_rad = turn(
        before.course_to(target.point),
        math.atan2(target.following[0] - target.point[0], target.following[1] - target.point[1]),
    )
    sideways = quantity(flight.facts, Quantity.CORNER_SHARE) * quantity(flight.facts, Quantity.HOVER_ACCELERATION_M_S2)
    return min(speed_m_s, speed_in_turn_m_s(turns_rad, sideways, target.radius_m))


def _limits(flight: Flight, speed_m_s: float) -> Limits:
    facts = flight.facts
    return Limits(
        speed_m_s,
        max(0.1, quantity(facts, Quantity.HOVER_ACCELERATION_M_S2)),
        max(0.5, quantity(facts, Quantity.HOVER_JERK_M_S3)),
    )
