"""PX4 in OFFBOARD mode: the setpoint forms that each vehicle follows, and what it does when setpoints stop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from app.domain.autopilot.capability import YES, AuditedParameter, Cell, FirmwareProfile, FlightKind, Support
from app.domain.vehicle.state import FirmwareVersion

# The setpoint forms that each vehicle with PX4 follows: as documented, and as flown. They differ.
#
# Sources: PX4's Offboard Mode page (v1.8 to v1.14); PX4 main bb59c637, flown in SITL or read in its source.


TYPES_DECODED_BEFORE: Final = FirmwareVersion(1, 12, 0)
"""v1.12 rewrote offboard control: setpoint types and thrust in the acceleration fields were removed."""
FLOWN_SINCE: Final = FirmwareVersion(1, 16, 0)


def _no(code: str, reason: str) -> Support:
    return Support(f"setpoint.{code}", reason)


_FRAME = _no("frame_unsupported", "PX4 drops positions in this frame")
_THRUST = _no("acceleration_is_thrust", "PX4 reads an acceleration in SET_POSITION_TARGET_GLOBAL_INT as thrust")
_LOW_LEVEL = _no("bypasses_control", "it bypasses all controllers of PX4 and has no MAVLink setpoint (ROS 2 only)")
_TYPES_GONE = _no("type_not_decoded", "current firmware ignores setpoint types, so the vehicle would do something else")
_NO_TYPES = _no("type_unsupported", "setpoint types apply to fixed wings and rovers only")
_NORTH = _no("not_followed", "with a position alone, current firmware flies due north: send position and velocity")
_IGNORED = _no("not_followed", "PX4 does not follow it on this vehicle")
_UNFLOWN = _no("not_flown", "it was not flown on current firmware, so its effect is unknown")
_VELOCITY_IGNORED = _no("not_followed", "according to PX4's documentation, this vehicle ignores the velocity")
_YAW_ONLY = _no("not_followed", "it has no effect on a rover with current firmware")
_AIRSHIP = _no("vehicle_unsupported", "PX4 documents no setpoint that an airship follows")

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
    FlightKind.AIRSHIP: dict.fromkeys({**_ROTARY, **_REFUSED_BY_ALL}, Cell(_AIRSHIP, _AIRSHIP)),
}


def firmware_profile(firmware: FirmwareVersion | None) -> FirmwareProfile:
    """Return the column for a firmware version."""
    if firmware is None or TYPES_DECODED_BEFORE <= firmware < FLOWN_SINCE:
        return FirmwareProfile.UNSURE
    return FirmwareProfile.DOCUMENTED if firmware < TYPES_DECODED_BEFORE else FirmwareProfile.FLOWN


LOSS_ACTIONS: Final[Mapping[int, str]] = {
    0: "position mode",
    1: "altitude mode",
    2: "stabilized mode",
    3: "return",
    4: "land",
    5: "hold",
    6: "terminate",
    7: "disarm",
}
"""COM_OBL_RC_ACT."""
SAFE_ACTIONS: Final = frozenset({3, 4, 5})
NEEDS_STICKS: Final = frozenset({0, 1, 2})
AUDITED: Final = (
    "COM_OBL_RC_ACT",
    "COM_OF_LOSS_T",
    "COM_RC_IN_MODE",
    "COM_RC_OVERRIDE",
    "COM_RC_STICK_OV",
    "COM_RCL_EXCEPT",
    "NAV_DLL_ACT",
)
AUDITED_COMMANDED: Final = ("NAV_LOITER_RAD", "COM_RC_IN_MODE", "COM_RC_OVERRIDE", "NAV_DLL_ACT")
"""For a fixed wing under control by commands: no stream can be lost."""
MERGED: Final = {"MAN_OVERRIDE_SPD": ("COM_RC_OVERRIDE", "COM_RC_STICK_OV")}
"""Since June 2026. Its switch by mode is gone: it counts in offboard and in all automatic modes."""
LONGEST_LOSS_S: Final = 2.0


def commanded_entry(name: str, value: float | int | None, _sticks_held: bool) -> AuditedParameter:
    """A fixed wing under control by commands is in Hold. Nothing blocks, because its fallback is the mode that it is
    in.
    """
    if name == "NAV_LOITER_RAD" and value is not None:
        return AuditedParameter(
            name, value, False, "metres: without Waydrop, it circles at this radius at its last position"
        )
    if name == "COM_RC_OVERRIDE" and value is not None:
        word = "sticks take over in Hold" if int(value) & 1 else "sticks take over by a mode switch only"
        return AuditedParameter(name, value, False, f"bit 0: {word}")
    return entry(name, value, False)


def _override_meaning(value: float | int) -> str:
    if value < 0:
        return "sticks take over by a mode switch only"
    return "stick travel per second that takes over from a multicopter or a hovering VTOL"


def entry(name: str, value: float | int | None, sticks_held: bool) -> AuditedParameter:
    """For a vehicle that follows a setpoint stream."""
    if name == "COM_OBL_RC_ACT":
        return _loss_action(value, sticks_held=sticks_held)
    if name == "COM_OF_LOSS_T":
        slow = value is None or value > LONGEST_LOSS_S
        late = ": this is long" if slow else ""
        return AuditedParameter(name, value, False, f"seconds after the last setpoint{late}", doubtful=slow)
    meanings = {
        "COM_RC_IN_MODE": "4: sticks are ignored" if value == 4 else "sticks are enabled",
        "COM_RC_OVERRIDE": "bit 1: sticks take over in offboard mode"
        if int(value or 0) & 2
        else "sticks take over by a mode switch only",
        "MAN_OVERRIDE_SPD": _override_meaning(value or 0),
        "COM_RC_STICK_OV": "stick movement in percent that takes over",
        "COM_RCL_EXCEPT": "bit 2: loss of RC is ignored in offboard mode"
        if int(value or 0) & 4
        else "loss of RC triggers a failsafe in offboard mode too",
        "NAV_DLL_ACT": "0: loss of the ground station is ignored"
        if value == 0
        else "reacts to loss of the ground station",
    }
    doubtful = (name == "NAV_DLL_ACT" and value == 0) or (name == "COM_RC_IN_MODE" and value == 4 and sticks_held)
    return AuditedParameter(name, value, False, "no answer" if value is None else meanings[name], doubtful=doubtful)


def _loss_action(value: float | int | None, *, sticks_held: bool) -> AuditedParameter:
    name = "COM_OBL_RC_ACT"
    if value is None:
        return AuditedParameter(name, None, True, "no answer, so the reaction to a loss of setpoints is unknown")
    action = int(value)
    word = LOSS_ACTIONS.get(action, "not a known action")
    if action in SAFE_ACTIONS:
        return AuditedParameter(name, action, False, f"on loss of setpoints: {word}")
    if action in NEEDS_STICKS and sticks_held:
        return AuditedParameter(name, action, False, f"on loss of setpoints, control goes to the sticks: {word}")
    why = "which requires a pilot at the sticks" if action in NEEDS_STICKS else "which is not a safe reaction"
    return AuditedParameter(name, action, True, f"on loss of setpoints: {word}, {why}; set it to 3, 4 or 5")
