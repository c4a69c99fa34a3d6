"""Which vehicle with PX4 takes which setpoint form, by its documents and as flown. They differ.

Sources: PX4's Offboard Mode page (v1.8 to v1.14), and PX4 main bb59c637 flown in SITL or read in its source.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from app.domain.setpoint.capability import YES, Cell, FirmwareProfile, FlightKind, Verdict
from app.domain.setpoint.wire_form import WIRE_FORMS
from app.domain.vehicle import FirmwareVersion

TYPES_DECODED_BEFORE: Final = FirmwareVersion(1, 12, 0)
"""v1.12 rewrote offboard: setpoint types and thrust in acceleration went."""
FLOWN_SINCE: Final = FirmwareVersion(1, 16, 0)


def _no(code: str, reason: str) -> Verdict:
    return Verdict(f"setpoint.{code}", reason)


_FRAME = _no("frame_unsupported", "PX4 takes no position in this frame: it would be dropped")
_THRUST = _no("acceleration_is_thrust", "in SET_POSITION_TARGET_GLOBAL_INT PX4 takes an acceleration for a thrust")
_LOW_LEVEL = _no("bypasses_control", "it bypasses every controller of PX4 and has no MAVLink setpoint: ROS 2 only")
_TYPES_GONE = _no("type_not_decoded", "current firmware decodes no setpoint types: the vehicle would do something else")
_NO_TYPES = _no("type_unsupported", "setpoint types are for fixed wings and rovers")
_NORTH = _no("not_followed", "current firmware flies due north with a position alone: give position and velocity")
_IGNORED = _no("not_followed", "PX4 does not follow it on this vehicle")
_UNFLOWN = _no("not_flown", "it has not been flown on current firmware: what the vehicle does is not known")
_VELOCITY_IGNORED = _no("not_followed", "by PX4's documents this vehicle ignores the velocity")
_YAW_ONLY = _no("not_followed", "current firmware does nothing with it on a rover")
_AIRSHIP = _no("vehicle_unsupported", "PX4 names no setpoint that an airship follows")

_REFUSED_BY_ALL: Final[Mapping[str, Cell]] = {
    "position_body": Cell(_FRAME, _FRAME),
    "position_offset_ned": Cell(_FRAME, _FRAME),
    "acceleration_global": Cell(_THRUST, _THRUST),
    "thrust_torque": Cell(_LOW_LEVEL, _LOW_LEVEL),
    "actuators": Cell(_LOW_LEVEL, _LOW_LEVEL),
}
_ROTARY: Final[Mapping[str, Cell]] = {
    **dict.fromkeys(
        (
            *("position_ned", "velocity_ned", "acceleration_ned"),
            *("position_velocity_ned", "position_velocity_acceleration_ned"),
            *("velocity_body", "acceleration_body"),
            *("position_global", "velocity_global", "position_velocity_global", "attitude", "body_rates"),
        ),
        Cell(YES, YES),
    ),
    "typed_position_ned": Cell(_NO_TYPES, _NO_TYPES),
    "typed_position_global": Cell(_NO_TYPES, _NO_TYPES),
}
_WING: Final[Mapping[str, Cell]] = {
    "position_ned": Cell(YES, _NORTH),
    "velocity_ned": Cell(_IGNORED, _IGNORED),
    "acceleration_ned": Cell(_IGNORED, _IGNORED),
    "position_velocity_ned": Cell(_VELOCITY_IGNORED, YES),
    "position_velocity_acceleration_ned": Cell(_VELOCITY_IGNORED, _UNFLOWN),
    "velocity_body": Cell(_IGNORED, _IGNORED),
    "acceleration_body": Cell(_IGNORED, _IGNORED),
    "position_global": Cell(YES, _NORTH),
    "velocity_global": Cell(_IGNORED, _IGNORED),
    "position_velocity_global": Cell(_VELOCITY_IGNORED, _UNFLOWN),
    "attitude": Cell(YES, YES),
    "body_rates": Cell(YES, _UNFLOWN),
    "typed_position_ned": Cell(YES, _TYPES_GONE),
    "typed_position_global": Cell(YES, _TYPES_GONE),
}
_ROVER: Final[Mapping[str, Cell]] = {
    "position_ned": Cell(YES, YES),
    "velocity_ned": Cell(YES, YES),
    "acceleration_ned": Cell(_IGNORED, _IGNORED),
    "position_velocity_ned": Cell(_VELOCITY_IGNORED, _UNFLOWN),
    "position_velocity_acceleration_ned": Cell(_VELOCITY_IGNORED, _UNFLOWN),
    "velocity_body": Cell(YES, YES),
    "acceleration_body": Cell(_IGNORED, _IGNORED),
    "position_global": Cell(YES, YES),
    "velocity_global": Cell(_IGNORED, _UNFLOWN),
    "position_velocity_global": Cell(_VELOCITY_IGNORED, _UNFLOWN),
    "attitude": Cell(YES, _YAW_ONLY),
    "body_rates": Cell(_IGNORED, _IGNORED),
    "typed_position_ned": Cell(YES, _TYPES_GONE),
    "typed_position_global": Cell(YES, _TYPES_GONE),
}
TABLE: Final[Mapping[FlightKind, Mapping[str, Cell]]] = {
    FlightKind.ROTARY: {**_ROTARY, **_REFUSED_BY_ALL},
    FlightKind.WING: {**_WING, **_REFUSED_BY_ALL},
    FlightKind.ROVER: {**_ROVER, **_REFUSED_BY_ALL},
    FlightKind.AIRSHIP: dict.fromkeys(WIRE_FORMS, Cell(_AIRSHIP, _AIRSHIP)),
}


def firmware_profile(firmware: FirmwareVersion | None) -> FirmwareProfile:
    """Which column a firmware is judged by."""
    if firmware is None or TYPES_DECODED_BEFORE <= firmware < FLOWN_SINCE:
        return FirmwareProfile.UNSURE
    return FirmwareProfile.DOCUMENTED if firmware < TYPES_DECODED_BEFORE else FirmwareProfile.FLOWN
