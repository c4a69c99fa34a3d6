"""Distance and time of one item. Constants are fitted to the recorded PX4 flights."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.domain.compiler.drop_items import EMBEDDED_HOLD_S, bound_s, settle_s
from app.domain.consent import CONSENT_MARGIN_S
from app.domain.default_facts import parameter
from app.domain.geo import distance_m
from app.domain.landing_pattern import LandingPattern, landing_pattern
from app.domain.plan.drops import DropUse
from app.domain.plan.items import Delay, Land, Loiter, PlanItem, ReturnToLaunch, Takeoff, Transition, Waypoint
from app.domain.plan.walk import Carried, Place, Step
from app.domain.prediction.vertical import TOUCHDOWN_S, climb_s, touchdown_s
from app.domain.vehicle import GlobalPosition, VehicleFacts, VehicleType

CRUISE_SHARE = 0.93
"""A multicopter creeps up to its cruise speed: 4.6 m/s of 5 on a leg of 60 m."""
SPEED_UP_S = 1.0
BRAKE_S = 3.0
SPIN_UP_S = 2.5
RUNWAY_S = 6.0
TRANSITION_S = 3.0
SUPERVISED_S = 2.0
"""Coming to rest, checks and answers around a supervised release, on top of the gripper's own time."""


@dataclass(frozen=True, slots=True)
class Effort:
    """What one item takes."""

    distance_m: float
    duration_s: float


@dataclass(frozen=True, slots=True)
class Flight:
    """What the prediction of an item needs to know of its flight."""

    facts: VehicleFacts
    home: GlobalPosition


def effort(flight: Flight, step: Step, speed_m_s: float, drop: DropUse | None) -> Effort:
    """Distance and time of an item. `drop` is the item's own, or the one for which a waypoint brakes."""
    item = step.item
    match item:
        case Takeoff():
            return _takeoff(flight, step, speed_m_s)
        case Waypoint():
            leg = _leg(flight.facts, step, speed_m_s, brakes=drop is not None or item.hold_s > 0)
            return Effort(leg.distance_m, leg.duration_s + _hold_s(item, step, drop))
        case Loiter():
            return _loiter(flight, item, step, speed_m_s)
        case Land():
            return _land(flight, item, step, speed_m_s)
        case ReturnToLaunch():
            return _return(flight, step, speed_m_s)
    return Effort(0.0, _standing_s(flight.facts, item, drop))


def _leg(facts: VehicleFacts, step: Step, speed_m_s: float, brakes: bool) -> Effort:
    start, end = step.start, step.end
    away_m = distance_m(start.latitude_deg, start.longitude_deg, end.latitude_deg, end.longitude_deg)
    return Effort(away_m, max(_level_s(step.after, away_m, speed_m_s, brakes), _rise_s(facts, step)))


def _level_s(carried: Carried, away_m: float, speed_m_s: float, brakes: bool) -> float:
    if away_m < 1.0:
        return 0.0
    if carried is Carried.FIXED_WING:
        return away_m / speed_m_s
    return away_m / max(0.1, speed_m_s * CRUISE_SHARE) + SPEED_UP_S + (BRAKE_S if brakes else 0.0)


def _rise_s(facts: VehicleFacts, step: Step) -> float:
    return climb_s(facts, step.after, step.end.relative_altitude_m - step.start.relative_altitude_m)


def _hold_s(item: Waypoint, step: Step, drop: DropUse | None) -> float:
    if step.after is not Carried.ROTARY_WING or (drop is not None and drop.supervised):
        return 0.0  # a supervised drop cuts the hold short; its own entry has its time
    return max(item.hold_s, EMBEDDED_HOLD_S) if drop is not None else item.hold_s


def _takeoff(flight: Flight, step: Step, speed_m_s: float) -> Effort:
    height_m = step.end.relative_altitude_m - step.start.relative_altitude_m
    start, end = step.start, step.end
    away_m = distance_m(start.latitude_deg, start.longitude_deg, end.latitude_deg, end.longitude_deg)
    if flight.facts.vehicle_type is VehicleType.FIXED_WING:
        return Effort(away_m, max(climb_s(flight.facts, Carried.FIXED_WING, height_m) + RUNWAY_S, away_m / speed_m_s))
    rising_s = max(0.0, height_m) / max(0.1, parameter(flight.facts, "MPC_TKO_SPEED")) + SPIN_UP_S
    if flight.facts.vehicle_type is VehicleType.VTOL:
        return Effort(away_m, rising_s + TRANSITION_S + away_m / max(0.1, speed_m_s))
    return Effort(away_m, rising_s + _level_s(step.after, away_m, speed_m_s, brakes=True))


def _loiter(flight: Flight, item: Loiter, step: Step, speed_m_s: float) -> Effort:
    leg = _leg(flight.facts, step, speed_m_s, brakes=True)
    seconds = item.duration_s or 0.0
    circling = step.after in (Carried.FIXED_WING, Carried.BUOYANCY)
    if item.kind == "turns":
        radius_m = abs(item.radius_m or parameter(flight.facts, "NAV_LOITER_RAD"))
        seconds = (item.turns or 0.0) * math.tau * radius_m / max(0.1, speed_m_s) if circling else 0.0
    return Effort(leg.distance_m + (speed_m_s * seconds if circling else 0.0), leg.duration_s + seconds)


def _land(flight: Flight, item: Land, step: Step, speed_m_s: float) -> Effort:
    if step.before is Carried.FIXED_WING and flight.facts.vehicle_type is VehicleType.FIXED_WING:
        return _glide(flight, landing_pattern(item, step.start, flight.home, flight.facts), step.start, speed_m_s)
    start, end = step.start, step.end
    away_m = distance_m(start.latitude_deg, start.longitude_deg, end.latitude_deg, end.longitude_deg)
    level_s = _level_s(step.before, away_m, max(0.1, speed_m_s), brakes=True)
    transition_s = TRANSITION_S if step.before is Carried.FIXED_WING else 0.0
    down_s = touchdown_s(flight.facts, start.relative_altitude_m - end.relative_altitude_m)
    return Effort(away_m, level_s + transition_s + down_s)


def _glide(flight: Flight, pattern: LandingPattern, start: Place, speed_m_s: float) -> Effort:
    """To the circle, down on it, and along the tangent to the ground."""
    circle = pattern.circle
    away_m = distance_m(start.latitude_deg, start.longitude_deg, circle.latitude_deg, circle.longitude_deg)
    down_s = climb_s(flight.facts, Carried.FIXED_WING, circle.relative_altitude_m - start.relative_altitude_m)
    half_turn_s = math.pi * abs(pattern.radius_m) / speed_m_s
    circling_s = max(half_turn_s, down_s - away_m / speed_m_s)
    landing_m_s = max(1.0, parameter(flight.facts, "FW_LND_AIRSPD"))
    seconds = away_m / speed_m_s + circling_s + pattern.glide_m / landing_m_s + TOUCHDOWN_S
    return Effort(away_m + circling_s * speed_m_s + pattern.glide_m, seconds)


def _return(flight: Flight, step: Step, speed_m_s: float) -> Effort:
    """RTL: up to the return altitude (lower inside the cone), home, down, land."""
    facts, start = flight.facts, step.start
    away_m = distance_m(start.latitude_deg, start.longitude_deg, step.end.latitude_deg, step.end.longitude_deg)
    altitude_m = max(start.relative_altitude_m, _return_altitude_m(facts, away_m))
    up_s = climb_s(facts, step.before, altitude_m - start.relative_altitude_m)
    level_s = _level_s(step.before, away_m, max(0.1, speed_m_s), brakes=True)
    return Effort(away_m, up_s + level_s + touchdown_s(facts, altitude_m))


def _return_altitude_m(facts: VehicleFacts, away_m: float) -> float:
    highest, lowest = parameter(facts, "RTL_RETURN_ALT"), parameter(facts, "RTL_DESCEND_ALT")
    cone_deg = parameter(facts, "RTL_CONE_ANG")
    if not 0 < cone_deg < 90:
        return highest
    return max(min(highest, away_m / math.tan(math.radians(cone_deg))), min(highest, lowest))


def _longest_question_s(drop: DropUse) -> float:
    """An operator may take this long to consent; limits and batteries must bear the longest answer."""
    if drop.item.consent == "none":
        return 0.0
    return min(drop.item.consent_timeout_s or math.inf, max(0.0, bound_s(drop) - CONSENT_MARGIN_S))


def _standing_s(facts: VehicleFacts, item: PlanItem, drop: DropUse | None) -> float:
    match item:
        case Delay():
            return item.duration_s
        case Transition():
            return TRANSITION_S
    if drop is None or not drop.stopped:
        return 0.0
    if drop.supervised:
        return parameter(facts, "PD_GRIPPER_TO") + SUPERVISED_S + _longest_question_s(drop)
    return settle_s(drop.item, facts)
