"""A wing-borne vehicle: takeoff, legs, circles and landing at its airspeed, in a steady wind."""

from __future__ import annotations

import math

from app.domain.autopilot import Quantity, behaviour, quantity
from app.domain.items.landing_pattern import LandingPattern
from app.domain.prediction.motion import Effort, FlightContext, MotionState, Point, ahead, course, turn
from app.domain.vehicle.state import VehicleProfile

GRAVITY_M_S2 = 9.81
BANK_RAD = math.radians(43.0)
"""Recorded; PX4's FW_R_LIM of 50 degrees is not reached."""
RUN_S = 2.5
RUN_M = 12.0
"""From the start order to the climb, on the ground (recorded)."""
ALTITUDE_TOLERANCE_M = 0.8
LOITER_REACHED = 1.2
"""PX4 begins a loiter inside this many radii of its centre."""
EXIT_RAD = math.radians(8.0)
LANDED_S = 3.8
"""Flare, rolling out, and the land detector's two seconds (recorded)."""


def fly(flight: FlightContext, before: MotionState, point: Point, up_m: float, airspeed_m_s: float) -> Effort:
    """A leg: over one switch distance before the point. It turns onto the leg with a coordinated bank."""
    along = before.course_to(point)
    ground_m_s = flight.wind.ground_speed_m_s(airspeed_m_s, along)
    switch_m = behaviour(flight.facts).switch_distance_m(ground_m_s)
    way_m = max(0.0, before.away_m(point) - switch_m) + turn_m(before, along, airspeed_m_s)
    rise_m = abs(up_m - before.up_m) - quantity(flight.facts, Quantity.WING_ALTITUDE_RADIUS_M)
    rise_s = climb_s(flight.facts, math.copysign(max(0.0, rise_m), up_m - before.up_m))
    return Effort(way_m, max(way_m / ground_m_s, rise_s), before.arrived(point, switch_m, up_m, ground_m_s))


def take_off(flight: FlightContext, before: MotionState, point: Point, up_m: float, airspeed_m_s: float) -> Effort:
    """Run up and climb towards the point; over at its altitude, wherever that is."""
    climb_m_s = max(0.5, quantity(flight.facts, Quantity.WING_TAKEOFF_CLIMB_M_S))
    along = before.course_to(point)
    forward_m_s = flight.wind.ground_speed_m_s(math.sqrt(max(1.0, airspeed_m_s**2 - climb_m_s**2)), along)
    climbing_s = max(0.0, up_m - before.up_m - ALTITUDE_TOLERANCE_M) / climb_m_s
    away_m = RUN_M + forward_m_s * climbing_s
    there = ahead(before.point, along, away_m)
    return Effort(away_m, RUN_S + climbing_s, MotionState(there, up_m, forward_m_s, along, along))


def circle(
    flight: FlightContext,
    before: MotionState,
    centre: Point,
    up_m: float,
    radius_m: float,
    circling_s: float,
    airspeed_m_s: float,
) -> Effort:
    """To the circle, and so long on it. It is left wherever that is, on the tangent."""
    entered = _to_circle(flight, before, centre, abs(radius_m), airspeed_m_s)
    rise_s = climb_s(flight.facts, up_m - before.up_m)
    around_s = max(circling_s, rise_s - entered.duration_s)
    end = _around(entered.end, centre, radius_m, around_s * airspeed_m_s / abs(radius_m), airspeed_m_s)
    end = MotionState(end.point, up_m, end.speed_m_s, end.course_rad, end.heading_rad)
    return Effort(entered.distance_m + around_s * airspeed_m_s, entered.duration_s + around_s, end)


def land(flight: FlightContext, before: MotionState, pattern: LandingPattern, airspeed_m_s: float) -> Effort:
    """To the circle, down on it, off it towards the touchdown, and along the glide to the ground."""
    centre = flight.to_local(pattern.circle.latitude_deg, pattern.circle.longitude_deg)
    touchdown = flight.to_local(pattern.touchdown.latitude_deg, pattern.touchdown.longitude_deg)
    entered = _to_circle(flight, before, centre, abs(pattern.radius_m), airspeed_m_s)
    slow_m_s = max(1.0, quantity(flight.facts, Quantity.WING_SLOWEST_M_S))
    down_m = max(
        0.0,
        before.up_m
        - pattern.circle.relative_altitude_m
        - quantity(flight.facts, Quantity.WING_LANDING_ALTITUDE_RADIUS_M),
    )
    down_s = climb_s(flight.facts, -down_m)
    circling_m_s = slow_m_s if down_s > 1.0 else airspeed_m_s
    turns_rad = _until_exit_rad(entered.end, centre, touchdown, pattern.radius_m)
    lacking_rad = down_s * circling_m_s / abs(pattern.radius_m) - turns_rad
    turns_rad += math.tau * max(0, math.ceil(lacking_rad / math.tau))
    around_s = turns_rad * abs(pattern.radius_m) / circling_m_s
    glide_course = course(centre, touchdown)
    landing_m_s = quantity(flight.facts, Quantity.WING_LANDING_M_S)
    glide_m_s = flight.wind.ground_speed_m_s(landing_m_s if landing_m_s > 0.0 else slow_m_s, glide_course)
    seconds = entered.duration_s + around_s + pattern.glide_m / glide_m_s + LANDED_S
    way_m = entered.distance_m + around_s * circling_m_s + pattern.glide_m
    return Effort(way_m, seconds, before.standing(touchdown, pattern.touchdown.relative_altitude_m))


def climb_s(facts: VehicleProfile, height_m: float) -> float:
    """Seconds for a change of altitude on the wing."""
    rate_m_s = quantity(facts, Quantity.WING_CLIMB_M_S if height_m > 0 else Quantity.WING_SINK_M_S)
    return abs(height_m) / max(rate_m_s, 0.1)


def tightest_circle_m(speed_m_s: float) -> float:
    """The smallest radius of a coordinated turn. A circle that is smaller is not followed but overshot."""
    return speed_m_s**2 / (GRAVITY_M_S2 * math.tan(BANK_RAD))


def turn_m(before: MotionState, along_rad: float, airspeed_m_s: float) -> float:
    """How much longer the way is because it has to turn onto it first."""
    if before.course_rad is None:
        return 0.0
    angle = turn(before.course_rad, along_rad)
    return tightest_circle_m(airspeed_m_s) * (angle - math.sin(angle))


def _to_circle(
    flight: FlightContext, before: MotionState, centre: Point, radius_m: float, airspeed_m_s: float
) -> Effort:
    along = before.course_to(centre)
    ground_m_s = flight.wind.ground_speed_m_s(airspeed_m_s, along)
    way_m = max(0.0, before.away_m(centre) - LOITER_REACHED * radius_m)
    if way_m > 0.0:
        way_m += turn_m(before, along, airspeed_m_s)
    end = before.arrived(centre, LOITER_REACHED * radius_m, before.up_m, airspeed_m_s)
    return Effort(way_m, way_m / ground_m_s, end)


def _around(entered: MotionState, centre: Point, radius_m: float, angle_rad: float, speed_m_s: float) -> MotionState:
    side = math.copysign(1.0, radius_m)
    at = course(centre, entered.point) + side * angle_rad
    along = at + side * math.pi / 2.0
    return MotionState(ahead(centre, at, abs(radius_m)), entered.up_m, speed_m_s, along, along)


def _until_exit_rad(entered: MotionState, centre: Point, touchdown: Point, radius_m: float) -> float:
    """How far around the circle until the course is that to the touchdown."""
    side = math.copysign(1.0, radius_m)
    away_m = max(math.dist(centre, touchdown), abs(radius_m) + 1.0)
    exit_at = course(centre, touchdown) - side * math.acos(abs(radius_m) / away_m)
    return (side * (exit_at - course(centre, entered.point)) - EXIT_RAD) % math.tau
