"""How long a hovering vehicle takes to go up, to come down, to take off and to land."""

from __future__ import annotations

import math

from app.domain.autopilot import Quantity, quantity
from app.domain.prediction.smooth_speed import Limits, travel_s
from app.domain.vehicle import VehicleFacts, VehicleType

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


def climb_s(facts: VehicleFacts, height_m: float) -> float:
    """Seconds for a change of altitude while hovering, up (+) or down (-), until it counts as reached."""
    up = height_m > 0
    speed = quantity(facts, Quantity.CLIMB_M_S if up else Quantity.SINK_M_S)
    acceleration = quantity(facts, Quantity.CLIMB_ACCELERATION_M_S2 if up else Quantity.SINK_ACCELERATION_M_S2)
    return _rise_s(facts, abs(height_m), speed, acceleration)


def takes_off_s(facts: VehicleFacts, height_m: float) -> float:
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


def lands_vertically_s(facts: VehicleFacts, height_m: float, above_ground_m: float) -> float:
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


def _rise_s(facts: VehicleFacts, way_m: float, speed_m_s: float, acceleration: float, start_m_s: float = 0.0) -> float:
    if way_m <= ALTITUDE_TOLERANCE_M:
        return 0.0
    jerk = max(quantity(facts, Quantity.HOVER_JERK_M_S3), 0.5)
    limits = Limits(max(speed_m_s, _SLOWEST_M_S), max(acceleration, 0.1), jerk)
    end_m = ALTITUDE_TOLERANCE_M + LAG_M
    return travel_s(way_m + LAG_M, limits, start_m_s=start_m_s, end_m=end_m)
