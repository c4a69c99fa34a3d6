"""A VTOL between its two states: turning into the wind of its next leg, pushing ahead, and braking again."""

from __future__ import annotations

import math

from app.domain.autopilot import Quantity, quantity
from app.domain.plan.walk import Step
from app.domain.prediction import rotary, wing
from app.domain.prediction.motion import Effort, FlightContext, MotionState, Point, ahead, course, turn
from app.domain.prediction.rotary import takes_off_s
from app.domain.vehicle.state import FlightRegime, VehicleProfile, VehicleType

PUSH_M_S3 = 8.5
"""The pusher gains thrust at VT_PSHER_SLEW: the rate at which its acceleration increases."""
DRAG_PER_S = 1.25
SHORTEST_S = 2.0
"""VT_TRANS_MIN_TM."""
LONGEST_S = 15.0
"""VT_TRANS_TIMEOUT."""
STEP_S = 0.05
STOPPED_M_S = 1.2
"""What is left of a hover leg's speed when it has turned (recorded)."""
YAW_RAD_S2 = math.radians(20.0)
"""MPC_YAWRAUTO_ACC: PX4 turns as fast as it can brake again."""
YAW_TOLERANCE_RAD = math.radians(12.0)
"""MIS_YAW_ERR: turned far enough."""
HOVERS_AT_MOST_M_S = 5.7
"""Nose down, the wing pushes it down until the lift motors reach their limit: commanded to 8 m/s it flies 5.6."""
BRAKES_M_S2 = 2.0
"""VT_B_DEC_MSS: in a tail wind the pitch brakes."""
HEADING_TIMEOUT_S = 10.0
"""MIS_YAW_TMT of a VTOL: so long it may turn to a heading, then the mission fails."""


def take_off(flight: FlightContext, before: MotionState, point: Point, up_m: float, airspeed_m_s: float) -> Effort:
    """Straight up, turn, become a fixed wing, and on to the point."""
    up_s = takes_off_s(flight.facts, up_m - before.up_m)
    changed = to_wing(flight, before.standing(up_m=up_m), point)
    leg = wing.fly(flight, changed.end, point, up_m, airspeed_m_s)
    return Effort(changed.distance_m + leg.distance_m, up_s + changed.duration_s + leg.duration_s, leg.end)


def to_wing(flight: FlightContext, before: MotionState, towards: Point | None) -> Effort:
    """Turn towards the next point, then accelerate until the wing carries."""
    along = before.heading_rad or 0.0
    turn_s = 0.0
    if towards is not None and before.away_m(towards) > 0.5:
        wanted = course(before.point, towards)
        if before.heading_rad is not None:
            turn_s = _turn_s(turn(before.heading_rad, wanted))
        along = wanted
    needed_m_s = flight.wind.ground_speed_m_s(max(1.0, quantity(flight.facts, Quantity.TRANSITION_M_S)), along)
    start_m_s = min(before.speed_m_s, STOPPED_M_S) if turn_s > 0.0 else before.speed_m_s
    push_s, way_m, speed_m_s = _push(start_m_s, needed_m_s)
    there = ahead(before.point, along, way_m)
    return Effort(way_m, turn_s + push_s, MotionState(there, before.up_m, speed_m_s, along, along))


def _turn_s(angle_rad: float) -> float:
    """Until the remaining turn is within the tolerance."""
    if angle_rad <= YAW_TOLERANCE_RAD:
        return 0.0
    if angle_rad <= 2.0 * YAW_TOLERANCE_RAD:
        return math.sqrt(2.0 * (angle_rad - YAW_TOLERANCE_RAD) / YAW_RAD_S2)
    return 2.0 * math.sqrt(angle_rad / YAW_RAD_S2) - math.sqrt(2.0 * YAW_TOLERANCE_RAD / YAW_RAD_S2)


def _push(speed_m_s: float, needed_m_s: float) -> tuple[float, float, float]:
    """How long, how far and how fast, with the propeller gaining speed."""
    gone_s = way_m = 0.0
    while gone_s < LONGEST_S and (gone_s < SHORTEST_S or speed_m_s < needed_m_s):
        speed_m_s += (PUSH_M_S3 * gone_s - DRAG_PER_S * speed_m_s) * STEP_S
        way_m += speed_m_s * STEP_S
        gone_s += STEP_S
    return gone_s, way_m, speed_m_s


def to_hover(flight: FlightContext, before: MotionState) -> Effort:
    """The pusher stops and the air brakes, down to the speed that it hovers at."""
    left_m_s = min(before.speed_m_s, max(1.0, quantity(flight.facts, Quantity.HOVER_CRUISE_M_S)))
    along = before.course_rad or 0.0
    air_m_s = flight.wind.north_m_s * math.cos(along) + flight.wind.east_m_s * math.sin(along)
    brakes_s, way_m = _brake(before.speed_m_s, left_m_s, air_m_s)
    there = ahead(before.point, along, way_m)
    return Effort(way_m, brakes_s, MotionState(there, before.up_m, left_m_s, before.course_rad, before.heading_rad))


def _brake(speed_m_s: float, left_m_s: float, air_m_s: float) -> tuple[float, float]:
    """How long and how far; `air_m_s` is the wind from behind."""
    gone_s = way_m = 0.0
    while speed_m_s > left_m_s:
        speed_m_s -= max(BRAKES_M_S2, DRAG_PER_S * (speed_m_s - air_m_s)) * STEP_S
        way_m += speed_m_s * STEP_S
        gone_s += STEP_S
    return gone_s, way_m


def uncertainty_s(flight: FlightContext, step: Step) -> float:
    """In wind the fin turns a hovering VTOL, and sideways its lift motors are near their limit."""
    if flight.facts.vehicle_type is not VehicleType.VTOL or flight.wind.speed_m_s == 0.0:
        return 0.0
    ends_hovering = step.after in (FlightRegime.ROTARY_WING, FlightRegime.GROUND)
    if step.item.transition_to() is not None:
        return 0.0 if ends_hovering else HEADING_TIMEOUT_S
    starts_hovering = step.before in (FlightRegime.ROTARY_WING, FlightRegime.GROUND)
    return HEADING_TIMEOUT_S if starts_hovering or ends_hovering else 0.0


def hover_speed_m_s(facts: VehicleProfile, speed_m_s: float) -> float:
    """The speed that results from a commanded speed in hover."""
    return min(speed_m_s, HOVERS_AT_MOST_M_S) if facts.vehicle_type is VehicleType.VTOL else speed_m_s


def land(
    flight: FlightContext, before: MotionState, target: rotary.LegTarget, airspeed_m_s: float, hover_m_s: float
) -> Effort:
    """On the wing to one switch distance before the point, back to hovering, over the point, down."""
    leg = wing.fly(flight, before, target.point, before.up_m, airspeed_m_s)
    braked = to_hover(flight, leg.end)
    down = rotary.land(flight, braked.end, target, hover_m_s)
    return Effort(
        leg.distance_m + braked.distance_m + down.distance_m,
        leg.duration_s + braked.duration_s + down.duration_s,
        down.end,
    )
