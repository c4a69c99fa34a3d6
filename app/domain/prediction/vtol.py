"""A VTOL between its two states: turning into the wind of its next leg, pushing ahead, and braking again."""

from __future__ import annotations

import math

from app.domain.default_facts import parameter
from app.domain.prediction import rotary, wing
from app.domain.prediction.effort import Effort, Flight
from app.domain.prediction.motion import Motion, Point, ahead, course, turn
from app.domain.prediction.vertical import takes_off_s

FORWARD_M_S2 = 4.4
"""Reaches VT_ARSP_TRANS of 10 m/s 2.3 s after the order (recorded)."""
YAW_RATE_RAD_S = math.radians(45.0)
YAW_TOLERANCE_RAD = math.radians(12.0)
"""MIS_YAW_ERR: turned far enough."""
BACK_S = 0.65
BACK_M_S2 = 11.0
"""Back to hovering, from 10.3 to 3.2 m/s (recorded)."""


def take_off(flight: Flight, before: Motion, point: Point, up_m: float, airspeed_m_s: float) -> Effort:
    """Straight up, turn, become a fixed wing, and on to the point."""
    up_s = takes_off_s(flight.facts, up_m - before.up_m)
    changed = to_wing(flight, before.standing(up_m=up_m), point)
    leg = wing.fly(flight, changed.end, point, up_m, airspeed_m_s)
    return Effort(changed.distance_m + leg.distance_m, up_s + changed.duration_s + leg.duration_s, leg.end)


def to_wing(flight: Flight, before: Motion, towards: Point | None) -> Effort:
    """Turn towards the next point, then accelerate until the wing carries."""
    along = before.heading_rad or 0.0
    turn_s = 0.0
    if towards is not None and before.away_m(towards) > 0.5:
        wanted = course(before.point, towards)
        if before.heading_rad is not None:
            turn_s = max(0.0, turn(before.heading_rad, wanted) - YAW_TOLERANCE_RAD) / YAW_RATE_RAD_S
        along = wanted
    needed_m_s = max(1.0, parameter(flight.facts, "VT_ARSP_TRANS"))
    over_ground_m_s = flight.wind.ground_speed_m_s(needed_m_s, along)
    way_m = over_ground_m_s**2 / (2.0 * FORWARD_M_S2)
    there = ahead(before.point, along, way_m)
    end = Motion(there, before.up_m, over_ground_m_s, along, along)
    return Effort(way_m, turn_s + over_ground_m_s / FORWARD_M_S2, end)


def to_hover(before: Motion) -> Effort:
    """Brake with the whole vehicle; what is left of the speed the hovering vehicle has to lose."""
    left_m_s = max(0.0, before.speed_m_s - BACK_M_S2 * BACK_S)
    way_m = (before.speed_m_s + left_m_s) / 2.0 * BACK_S
    along = before.course_rad or 0.0
    there = ahead(before.point, along, way_m)
    return Effort(way_m, BACK_S, Motion(there, before.up_m, left_m_s, before.course_rad, before.heading_rad))


def land(flight: Flight, before: Motion, target: rotary.Target, airspeed_m_s: float, hover_m_s: float) -> Effort:
    """On the wing to one switch distance before the point, back to hovering, over the point, down."""
    leg = wing.fly(flight, before, target.point, before.up_m, airspeed_m_s)
    braked = to_hover(leg.end)
    down = rotary.land(flight, braked.end, target, hover_m_s)
    return Effort(
        leg.distance_m + braked.distance_m + down.distance_m,
        leg.duration_s + braked.duration_s + down.duration_s,
        down.end,
    )
