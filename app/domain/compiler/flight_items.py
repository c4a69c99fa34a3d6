"""Plan items that fly, land or wait, as mission items of PX4. Drops are in drop_items."""

from __future__ import annotations

from app.domain.compiler.draft import Draft, command_draft, position_draft
from app.domain.errors import PlanRejectedError
from app.domain.landing_pattern import LandingPattern, landing_pattern
from app.domain.mission import NAN, MavCmd
from app.domain.plan.fields import Altitude
from app.domain.plan.items import (
    ChangeSpeed,
    Delay,
    Jump,
    Land,
    Loiter,
    PlanItem,
    ReturnToLaunch,
    Takeoff,
    Transition,
    Waypoint,
)
from app.domain.plan.walk import Place, Step
from app.domain.vehicle import GlobalPosition, VehicleFacts, VehicleType

_AIRSPEED, _GROUND_SPEED = 0.0, 1.0
_THROTTLE_UNCHANGED = -1.0
_VTOL_STATE = {"multicopter": 3.0, "fixed_wing": 4.0}
_DEFAULT_PITCH_DEG = 15.0
_TANGENT_EXIT = 1.0


def flight_drafts(step: Step, home: GlobalPosition, facts: VehicleFacts) -> tuple[Draft, ...]:
    """The mission items of a plan item, in order. Empty for drops. Waypoints with a drop: see `waypoint_draft`."""
    item, vehicle_type = step.item, facts.vehicle_type
    match item:
        case Takeoff():
            return (_takeoff(item, step.end, vehicle_type),)
        case Waypoint():
            return (
                *speed_drafts(item.speed_m_s, vehicle_type),
                waypoint_draft(item, item.hold_s, item.acceptance_radius_m),
            )
        case Loiter():
            return (_loiter(item, step.end),)
        case Land():
            return _land(item, step, home, facts)
    return _without_position(item, vehicle_type)


def waypoint_draft(item: Waypoint | Loiter | Land, hold_s: float, acceptance_radius_m: float | None) -> Draft:
    """NAV_WAYPOINT at an item's place. Both hold and radius make a multicopter stop; either alone does not (flown)."""
    radius = NAN if acceptance_radius_m is None else acceptance_radius_m
    return position_draft(MavCmd.NAV_WAYPOINT, item, _place(item), (hold_s, radius, 0.0, _or_nan(item.yaw_deg)))


def delay_draft(duration_s: float) -> Draft:
    """NAV_DELAY for a time. -1 switches off the time of day."""
    return command_draft(MavCmd.NAV_DELAY, duration_s, -1.0, -1.0, -1.0)


def speed_drafts(
    speed_m_s: float | None, vehicle_type: VehicleType, speed_type: str | None = None
) -> tuple[Draft, ...]:
    """DO_CHANGE_SPEED, or nothing if no speed is asked for."""
    if speed_m_s is None:
        return ()
    airspeed = speed_type == "airspeed" or (speed_type is None and vehicle_type is VehicleType.FIXED_WING)
    kind = _AIRSPEED if airspeed else _GROUND_SPEED
    return (command_draft(MavCmd.DO_CHANGE_SPEED, kind, speed_m_s, _THROTTLE_UNCHANGED),)


def _takeoff(item: Takeoff, place: Place, vehicle_type: VehicleType) -> Draft:
    yaw = _or_nan(item.yaw_deg)
    if vehicle_type is VehicleType.VTOL:
        return position_draft(MavCmd.NAV_VTOL_TAKEOFF, item, place, (0.0, 0.0, 0.0, yaw))
    default = _DEFAULT_PITCH_DEG if vehicle_type is VehicleType.FIXED_WING else 0.0
    pitch = default if item.pitch_deg is None else item.pitch_deg
    return position_draft(MavCmd.NAV_TAKEOFF, item, place, (pitch, 0.0, 0.0, yaw))


def _loiter(item: Loiter, place: Place) -> Draft:
    radius, yaw = _or_nan(item.radius_m), _or_nan(item.yaw_deg)
    match item.kind:
        case "time":
            return position_draft(MavCmd.NAV_LOITER_TIME, item, place, (item.duration_s or 0.0, 0.0, radius, 0.0))
        case "unlimited":
            return position_draft(MavCmd.NAV_LOITER_UNLIM, item, place, (0.0, 0.0, radius, yaw))
        case "to_altitude":
            return position_draft(MavCmd.NAV_LOITER_TO_ALT, item, place, (0.0, radius, 0.0, 0.0))
        case "turns":
            raise PlanRejectedError("PX4 takes no NAV_LOITER_TURNS", hint="use kind time with duration_s")


def _land(item: Land, step: Step, home: GlobalPosition, facts: VehicleFacts) -> tuple[Draft, ...]:
    params = (0.0, 0.0, 0.0, _or_nan(item.yaw_deg))
    if facts.vehicle_type is VehicleType.VTOL:
        return (position_draft(MavCmd.NAV_VTOL_LAND, item, step.end, params),)
    landing = position_draft(MavCmd.NAV_LAND, item, step.end, params)
    if facts.vehicle_type is not VehicleType.FIXED_WING:
        return (landing,)
    return (
        command_draft(MavCmd.DO_LAND_START),
        _approach(item, landing_pattern(item, step.start, home, facts), home),
        landing,
    )


def _approach(item: Land, pattern: LandingPattern, home: GlobalPosition) -> Draft:
    """LOITER_TO_ALT: towards the next item (heading required), left on the tangent."""
    altitude: Altitude = item.approach or item
    height_m = pattern.circle.relative_altitude_m
    if altitude.absolute_altitude_m is None:
        given = Altitude(relative_altitude_m=height_m)
    else:
        given = Altitude(absolute_altitude_m=height_m + home.altitude_m)
    return position_draft(MavCmd.NAV_LOITER_TO_ALT, given, pattern.circle, (1.0, pattern.radius_m, 0.0, _TANGENT_EXIT))


def _without_position(item: PlanItem, vehicle_type: VehicleType) -> tuple[Draft, ...]:
    match item:
        case Delay():
            return (delay_draft(item.duration_s),)
        case ChangeSpeed():
            return speed_drafts(item.speed_m_s, vehicle_type, item.speed_type)
        case Transition():
            return (command_draft(MavCmd.DO_VTOL_TRANSITION, _VTOL_STATE[item.to], 0.0),)
        case ReturnToLaunch():
            return (command_draft(MavCmd.NAV_RETURN_TO_LAUNCH),)
        case Jump():
            return (command_draft(MavCmd.DO_JUMP, NAN, float(item.repeats), jump_to=item.target),)
    return ()


def _place(item: Waypoint | Loiter | Land) -> Place:
    return Place(item.latitude_deg, item.longitude_deg, 0.0)


def _or_nan(value: float | None) -> float:
    return NAN if value is None else value
