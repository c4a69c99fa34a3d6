"""PX4's flight modes in HEARTBEAT.custom_mode and DO_SET_MODE (px4_custom_mode.h), and modes in which it cannot arm."""

from __future__ import annotations

from typing import Final

from app.domain.vehicle.state import FlightMode, VehicleType

_MAIN: Final = {
    1: FlightMode.MANUAL,
    2: FlightMode.ALTITUDE,
    3: FlightMode.POSITION,
    6: FlightMode.OFFBOARD,
    7: FlightMode.STABILIZED,
}
_AUTO: Final = {
    2: FlightMode.TAKEOFF,
    3: FlightMode.HOLD,
    4: FlightMode.MISSION,
    5: FlightMode.RETURN,
    6: FlightMode.LAND,
    9: FlightMode.LAND,
    10: FlightMode.TAKEOFF,
    20: FlightMode.DESCEND,
}
_MAIN_AUTO: Final = 4
_MAIN_POSITION: Final = 3
_MAIN_OFFBOARD: Final = 6
_SUB_ORBIT: Final = 1

_COMMANDED: Final = {
    FlightMode.MISSION: (_MAIN_AUTO, 4),
    FlightMode.HOLD: (_MAIN_AUTO, 3),
    FlightMode.RETURN: (_MAIN_AUTO, 5),
    FlightMode.LAND: (_MAIN_AUTO, 6),
    FlightMode.OFFBOARD: (_MAIN_OFFBOARD, 0),
}
"""Main mode and sub mode of the modes that Waydrop commands."""


def flight_mode(custom_mode: int, _vehicle_type: VehicleType | None = None) -> FlightMode:
    """Return the mode of a custom_mode: main mode in the third byte, sub mode in the fourth."""
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
    if main == _MAIN_AUTO:
        return _AUTO.get(sub, FlightMode.OTHER)
    if main == _MAIN_POSITION and sub == _SUB_ORBIT:
        return FlightMode.ORBIT
    return _MAIN.get(main, FlightMode.OTHER)


def mode_numbers(mode: FlightMode, _vehicle_type: VehicleType | None = None) -> tuple[int, int]:
    """Return main mode and sub mode."""
    return _COMMANDED[mode]


_NEEDS_STICKS: Final = "only with manual control input"
_NOT_ARMED: Final = {
    FlightMode.OFFBOARD: "only with a setpoint stream",
    FlightMode.POSITION: _NEEDS_STICKS,
    FlightMode.ALTITUDE: _NEEDS_STICKS,
    FlightMode.MANUAL: _NEEDS_STICKS,
    FlightMode.STABILIZED: _NEEDS_STICKS,
    FlightMode.RETURN: "never",
    FlightMode.LAND: "never",
    FlightMode.ORBIT: "never",
    FlightMode.DESCEND: "never",
    FlightMode.OTHER: "perhaps never",
}


def arming_obstacle(mode: FlightMode) -> str:
    """PX4 reports it only as an EVENT, if at all."""
    return f"PX4 arms in this mode {_NOT_ARMED[mode]}" if mode in _NOT_ARMED else ""
