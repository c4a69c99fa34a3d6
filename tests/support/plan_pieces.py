"""Pieces of plans as JSON data, in metres from one home, so that tests read like plans."""

from __future__ import annotations

from typing import Any

from app.domain.autopilot.declared import default_facts
from app.domain.geo import LocalProjection
from app.domain.plan import Plan, parse_plan
from app.domain.vehicle.state import FirmwareVersion, GlobalPosition, VehicleProfile, VehicleType

Json = dict[str, Any]
HOME = GlobalPosition(47.397742, 8.545594, 488.0)
_AROUND_HOME = LocalProjection(HOME.latitude_deg, HOME.longitude_deg)


def at(north_m: float, east_m: float, **more: Any) -> Json:
    """A place so many metres from home."""
    latitude, longitude = _AROUND_HOME.to_global(east_m, north_m)
    return {"latitude_deg": latitude, "longitude_deg": longitude, **more}


def takeoff(altitude_m: float = 15, **more: Any) -> Json:
    return {"type": "takeoff", "relative_altitude_m": altitude_m, **more}


def wing_takeoff() -> Json:
    return takeoff(40, **at(160, 0))


def waypoint(north_m: float = 100, east_m: float = 0, altitude_m: float = 30, **more: Any) -> Json:
    return {"type": "waypoint", **at(north_m, east_m), "relative_altitude_m": altitude_m, **more}


def loiter(kind: str = "time", north_m: float = 300, east_m: float = 0, **more: Any) -> Json:
    given = {"duration_s": 20} if kind == "time" else {}
    return {"type": "loiter", "kind": kind, **at(north_m, east_m), "relative_altitude_m": 40, **given, **more}


def land(north_m: float = 0, east_m: float = 0, **more: Any) -> Json:
    return {"type": "land", **at(north_m, east_m), "relative_altitude_m": 0, **more}


def gripper(release_motion: str = "stopped", action: str = "release", **more: Any) -> Json:
    return {"type": "gripper", "action": action, "release_motion": release_motion, **more}


def winch(release_motion: str = "stopped", action: str = "deliver", **more: Any) -> Json:
    return {"type": "winch", "action": action, "release_motion": release_motion, **more}


def delay(duration_s: float = 5) -> Json:
    return {"type": "delay", "duration_s": duration_s}


def change_speed(speed_m_s: float) -> Json:
    return {"type": "change_speed", "speed_m_s": speed_m_s}


def transition(to: str) -> Json:
    return {"type": "transition", "to": to}


RETURN: Json = {"type": "return_to_launch"}


def plan_json(vehicle_type: str, *items: Json, **more: Any) -> Json:
    home = {
        "latitude_deg": HOME.latitude_deg,
        "longitude_deg": HOME.longitude_deg,
        "absolute_altitude_m": HOME.altitude_m,
    }
    return {
        "version": 1,
        "name": "test",
        "vehicle_type": vehicle_type,
        "home": home,
        "items": list(items),
        **more,
    }


def plan(vehicle_type: str, *items: Json, **more: Any) -> Plan:
    return parse_plan(plan_json(vehicle_type, *items, **more))


def multicopter(*items: Json, **more: Any) -> Plan:
    """Takeoff, the items, return."""
    return plan("multicopter", takeoff(), *items, RETURN, **more)


def fixed_wing(*items: Json, **more: Any) -> Plan:
    """Takeoff, the items, a turn, landing with a computed approach."""
    return plan("fixed_wing", wing_takeoff(), *items, waypoint(400, 400, 40), land(), **more)


def vtol(*items: Json, **more: Any) -> Plan:
    """Takeoff and transition, the items, landing."""
    return plan("vtol", takeoff(30, **at(60, 0)), *items, land(), **more)


def rover(*items: Json, **more: Any) -> Plan:
    """The items, then a place to park."""
    return plan("rover", *items, waypoint(30, 25, 0), **more)


def airship(*items: Json, **more: Any) -> Plan:
    """Take off, the items, then the mast."""
    return plan("airship", takeoff(20), *items, waypoint(0, 0), **more)


def square(kind: str, north_m: float, east_m: float, half_m: float) -> Json:
    """A fence polygon with this centre."""
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return {"kind": kind, "vertices": [at(north_m + n * half_m, east_m + e * half_m) for n, e in corners]}


def circle(kind: str, north_m: float, east_m: float, radius_m: float) -> Json:
    return {"kind": kind, **at(north_m, east_m), "radius_m": radius_m}


def facts(
    vehicle_type: str = "multicopter",
    firmware: tuple[int, int, int] | None = (1, 18, 0),
    home: GlobalPosition | None = HOME,
    **parameters: float,
) -> VehicleProfile:
    """A known vehicle: the defaults of its type with a gripper on output 5, and these parameters."""
    defaults = default_facts(VehicleType(vehicle_type))
    return VehicleProfile(
        vehicle_type=defaults.vehicle_type,
        firmware=None if firmware is None else FirmwareVersion(*firmware),
        uid="0001",
        home=home,
        parameters={**defaults.parameters, "PWM_MAIN_FUNC5": 430, **parameters},
    )
