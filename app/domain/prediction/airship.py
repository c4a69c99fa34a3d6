"""An airship: slow, heavy, it cannot brake. Not recorded: this is what the simulated one does."""

from __future__ import annotations

import math

from app.domain.autopilot import Quantity, quantity
from app.domain.prediction.motion import Effort, FlightContext, MotionState, Point, turn
from app.domain.vehicle.state import VehicleProfile

ACCELERATION_M_S2 = 0.3
HEIGHT_GAIN_PER_S = 0.3
TURN_RATE_RAD_S = math.radians(12.0)
ALTITUDE_TOLERANCE_M = 0.8
RIGHT_ANGLE = math.pi / 2.0
SLOWEST_M_S = 1.0
"""Below it the rudder has no effect: it keeps so much also while it climbs."""


def fly(flight: FlightContext, before: MotionState, point: Point, up_m: float, speed_m_s: float) -> Effort:
    """A leg; it ends within the acceptance radius. Missing speed is gained slowly."""
    along = before.course_to(point)
    ground_m_s = flight.wind.ground_speed_m_s(max(speed_m_s, 0.1), along)
    reach_m = quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)
    angle = RIGHT_ANGLE if before.course_rad is None else turn(before.course_rad, along)  # any heading
    way_m = max(0.0, before.away_m(point) - reach_m) + speed_m_s / TURN_RATE_RAD_S * (angle - math.sin(angle))
    start_m_s = min(before.speed_m_s, speed_m_s)
    late_s = (speed_m_s - start_m_s) ** 2 / (2.0 * ACCELERATION_M_S2 * speed_m_s) if way_m > 0.0 else 0.0
    seconds = max(way_m / ground_m_s + late_s, climb_s(flight.facts, up_m - before.up_m) if way_m > 0.0 else 0.0)
    return Effort(way_m, seconds, before.arrived(point, reach_m, up_m, speed_m_s))


def take_off(flight: FlightContext, before: MotionState, up_m: float) -> Effort:
    """Straight up, nearly."""
    rising_s = climb_s(flight.facts, up_m - before.up_m)
    end = before.standing(up_m=up_m)
    return Effort(0.0, rising_s, MotionState(end.point, up_m, SLOWEST_M_S, None, before.heading_rad))


def climb_s(facts: VehicleProfile, height_m: float) -> float:
    """Up or down until the altitude counts as reached: the nearer it is, the slower it gets."""
    fastest = max(quantity(facts, Quantity.CLIMB_M_S), 0.1)
    height = abs(height_m)
    if height <= ALTITUDE_TOLERANCE_M:
        return 0.0
    slow_below_m = fastest / HEIGHT_GAIN_PER_S
    start_s = fastest / ACCELERATION_M_S2 / 2.0
    if height <= slow_below_m:
        return start_s + math.log(height / ALTITUDE_TOLERANCE_M) / HEIGHT_GAIN_PER_S
    ending_s = math.log(max(slow_below_m, ALTITUDE_TOLERANCE_M) / ALTITUDE_TOLERANCE_M) / HEIGHT_GAIN_PER_S
    return start_s + (height - slow_below_m) / fastest + ending_s
