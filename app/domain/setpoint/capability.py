"""The capability table: which vehicle takes which setpoint form, by PX4's documents and as flown. They differ.

Sources: PX4's Offboard Mode page (v1.8 to v1.14), and PX4 main bb59c637 flown in SITL or read in its source.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.setpoint.wire_form import WIRE_FORMS, WireForm
from app.domain.vehicle import FirmwareVersion, VehicleType

TYPES_DECODED_BEFORE: Final = FirmwareVersion(1, 12, 0)
"""v1.12 rewrote offboard: setpoint types and thrust in acceleration went."""
FLOWN_SINCE: Final = FirmwareVersion(1, 16, 0)


class FirmwareProfile(StrEnum):
    """Which column counts. Between the two, and with unknown firmware, only what both say is taken."""

    DOCUMENTED = "documented"
    FLOWN = "flown"
    UNSURE = "unsure"


class FlightKind(StrEnum):
    """What flies by the same rules: a VTOL is one or the other by its state."""

    ROTARY = "rotary"
    WING = "wing"
    ROVER = "rover"
    AIRSHIP = "airship"


@dataclass(frozen=True, slots=True)
class Verdict:
    """One cell: taken when `code` is empty, else refused with this code and reason."""

    code: str = ""
    reason: str = ""

    @property
    def is_taken(self) -> bool:
        """Whether the form may be sent."""
        return not self.code


@dataclass(frozen=True, slots=True)
class Capability:
    """One form for one vehicle: how it is sent, or why it is not."""

    form: str
    wire: WireForm
    verdict: Verdict


def _no(code: str, reason: str) -> Verdict:
    return Verdict(f"setpoint.{code}", reason)


YES: Final = Verdict()
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

Cell = tuple[Verdict, Verdict]
"""By the documents, as flown."""

_REFUSED_BY_ALL: Final[Mapping[str, Cell]] = {
    "position_body": (_FRAME, _FRAME),
    "position_offset_ned": (_FRAME, _FRAME),
    "acceleration_global": (_THRUST, _THRUST),
    "thrust_torque": (_LOW_LEVEL, _LOW_LEVEL),
    "actuators": (_LOW_LEVEL, _LOW_LEVEL),
}
_ROTARY: Final[Mapping[str, Cell]] = {
    **dict.fromkeys(
        (
            *("position_ned", "velocity_ned", "acceleration_ned"),
            *("position_velocity_ned", "position_velocity_acceleration_ned"),
            *("velocity_body", "acceleration_body"),
            *("position_global", "velocity_global", "position_velocity_global", "attitude", "body_rates"),
        ),
        (YES, YES),
    ),
    "typed_position_ned": (_NO_TYPES, _NO_TYPES),
    "typed_position_global": (_NO_TYPES, _NO_TYPES),
}
_WING: Final[Mapping[str, Cell]] = {
    "position_ned": (YES, _NORTH),
    "velocity_ned": (_IGNORED, _IGNORED),
    "acceleration_ned": (_IGNORED, _IGNORED),
    "position_velocity_ned": (_VELOCITY_IGNORED, YES),
    "position_velocity_acceleration_ned": (_VELOCITY_IGNORED, _UNFLOWN),
    "velocity_body": (_IGNORED, _IGNORED),
    "acceleration_body": (_IGNORED, _IGNORED),
    "position_global": (YES, _NORTH),
    "velocity_global": (_IGNORED, _IGNORED),
    "position_velocity_global": (_VELOCITY_IGNORED, _UNFLOWN),
    "attitude": (YES, YES),
    "body_rates": (YES, _UNFLOWN),
    "typed_position_ned": (YES, _TYPES_GONE),
    "typed_position_global": (YES, _TYPES_GONE),
}
_ROVER: Final[Mapping[str, Cell]] = {
    "position_ned": (YES, YES),
    "velocity_ned": (YES, YES),
    "acceleration_ned": (_IGNORED, _IGNORED),
    "position_velocity_ned": (_VELOCITY_IGNORED, _UNFLOWN),
    "position_velocity_acceleration_ned": (_VELOCITY_IGNORED, _UNFLOWN),
    "velocity_body": (YES, YES),
    "acceleration_body": (_IGNORED, _IGNORED),
    "position_global": (YES, YES),
    "velocity_global": (_IGNORED, _UNFLOWN),
    "position_velocity_global": (_VELOCITY_IGNORED, _UNFLOWN),
    "attitude": (YES, _YAW_ONLY),
    "body_rates": (_IGNORED, _IGNORED),
    "typed_position_ned": (YES, _TYPES_GONE),
    "typed_position_global": (YES, _TYPES_GONE),
}
TABLE: Final[Mapping[FlightKind, Mapping[str, Cell]]] = {
    FlightKind.ROTARY: {**_ROTARY, **_REFUSED_BY_ALL},
    FlightKind.WING: {**_WING, **_REFUSED_BY_ALL},
    FlightKind.ROVER: {**_ROVER, **_REFUSED_BY_ALL},
    FlightKind.AIRSHIP: dict.fromkeys(WIRE_FORMS, (_AIRSHIP, _AIRSHIP)),
}


def firmware_profile(firmware: FirmwareVersion | None) -> FirmwareProfile:
    """Which column a firmware is judged by."""
    if firmware is None or TYPES_DECODED_BEFORE <= firmware < FLOWN_SINCE:
        return FirmwareProfile.UNSURE
    return FirmwareProfile.DOCUMENTED if firmware < TYPES_DECODED_BEFORE else FirmwareProfile.FLOWN


def flight_kind(vehicle_type: VehicleType, vtol_state: str | None) -> FlightKind:
    """What the vehicle flies like now. A VTOL in transition, or that says nothing, counts as a wing."""
    if vehicle_type is VehicleType.VTOL:
        return FlightKind.ROTARY if vtol_state == "multicopter" else FlightKind.WING
    return {
        VehicleType.MULTICOPTER: FlightKind.ROTARY,
        VehicleType.FIXED_WING: FlightKind.WING,
        VehicleType.ROVER: FlightKind.ROVER,
        VehicleType.AIRSHIP: FlightKind.AIRSHIP,
    }[vehicle_type]


def capability(form: str, kind: FlightKind, profile: FirmwareProfile) -> Capability:
    """The table's word on one form. KeyError for a form that does not exist."""
    documented, flown = TABLE[kind][form]
    if profile is FirmwareProfile.DOCUMENTED:
        verdict = documented
    elif profile is FirmwareProfile.FLOWN or not flown.is_taken:
        verdict = flown
    else:
        verdict = documented
    return Capability(form, WIRE_FORMS[form], verdict)


def capabilities(kind: FlightKind, profile: FirmwareProfile) -> tuple[Capability, ...]:
    """The whole column for one vehicle."""
    return tuple(capability(form, kind, profile) for form in WIRE_FORMS)
