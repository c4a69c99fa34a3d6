"""A rover with Ackermann steering: it slows for corners, cuts them, and stops at its last point."""

from __future__ import annotations

import math

from app.domain.autopilot import Quantity, quantity
from app.domain.prediction.motion import Effort, FlightContext, MotionState, Point, turn
from app.domain.prediction.rotary import TrajectoryLimits, travel_s

START_M_S2, BRAKE_M_S2, JERK_M_S3 = 4.0, 2.0, 4.0
"""RO_ACCEL_LIM, RO_DECEL_LIM, RO_JERK_LIM of PX4's simulated rover."""
CORNER_M_S = 2.1
"""Recorded in right angles."""
CORNER_M, CORNER_MAX_M = 1.284, 3.0
"""Wheel base over the sine of the steering limit, times RA_ACC_RAD_GAIN; RA_ACC_RAD_MAX."""


def drive(
    flight: FlightContext, before: MotionState, point: Point, following: Point | None, speed_m_s: float
) -> Effort:
    """A leg: over inside the corner's radius, or the acceptance radius at the last point."""
    reach_m = corner_radius_m(flight, before, point, following)
    final_m_s = min(speed_m_s, CORNER_M_S) if following is not None else 0.0
    way_m = before.away_m(point)
    if way_m <= reach_m:
        return Effort(0.0, 0.0, before)
    limits = TrajectoryLimits(max(speed_m_s, 0.1), BRAKE_M_S2, JERK_M_S3)
    start_m_s = min(before.speed_m_s, speed_m_s)
    seconds = travel_s(way_m, limits, start_m_s=start_m_s, end_m=reach_m, final_m_s=final_m_s)
    quicker = TrajectoryLimits(limits.speed_m_s, START_M_S2, 1e3).start_s(speed_m_s - start_m_s)
    saved_s = (limits.start_s(speed_m_s - start_m_s) - quicker) * (1.0 - (speed_m_s + start_m_s) / 2.0 / speed_m_s)
    end = before.arrived(point, reach_m, 0.0, final_m_s or CORNER_M_S)
    return Effort(way_m - reach_m, max(0.0, seconds - saved_s), end)


def corner_radius_m(flight: FlightContext, before: MotionState, point: Point, following: Point | None) -> float:
    """How far before its point it turns in, so that it meets the next leg on a tangent."""
    default_m = quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)
    if following is None or math.dist(point, following) < 0.01:
        return default_m
    inside = math.pi - turn(before.course_to(point), math.atan2(following[0] - point[0], following[1] - point[1]))
    if inside < 1e-3:
        return max(default_m, CORNER_MAX_M)
    return max(default_m, min(CORNER_MAX_M, CORNER_M / max(1e-6, math.tan(inside / 2.0))))
