"""PX4's position smoothing in one dimension: how fast one may go at a distance from a point."""

from __future__ import annotations

import math


def speed_to_stop_m_s(distance_m: float, acceleration_m_s2: float, jerk_m_s3: float, final_m_s: float = 0.0) -> float:
    """Highest speed from which one still slows to `final_m_s` within `distance_m` (computeMaxSpeedFromDistance)."""
    b = 4.0 * acceleration_m_s2**2 / jerk_m_s3
    c = -2.0 * acceleration_m_s2 * max(distance_m, 0.0) - final_m_s**2
    return max(0.5 * (-b + math.sqrt(b * b - 4.0 * c)), final_m_s)


def stopping_distance_m(speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float) -> float:
    """How far ahead a vehicle that is told to hold will come to rest (computeBrakingDistanceFromVelocity)."""
    return speed_m_s * (speed_m_s / (2.0 * acceleration_m_s2) + acceleration_m_s2 / jerk_m_s3)


def speed_in_turn_m_s(
    before: tuple[float, float],
    at: tuple[float, float],
    after: tuple[float, float],
    acceleration_m_s2: float,
    radius_m: float,
) -> float:
    """Speed at which a multicopter may pass a corner of its track (computeMaxSpeedInWaypoint)."""
    to_before = (before[0] - at[0], before[1] - at[1])
    to_after = (after[0] - at[0], after[1] - at[1])
    lengths = math.hypot(*to_before) * math.hypot(*to_after)
    if lengths < 1e-6:
        return 0.0
    cosine = (to_before[0] * to_after[0] + to_before[1] * to_after[1]) / lengths
    angle = math.acos(max(-1.0, min(1.0, cosine)))
    if angle > math.pi - 1e-3:
        return math.inf
    return math.sqrt(acceleration_m_s2 * radius_m * math.tan(angle / 2.0))
