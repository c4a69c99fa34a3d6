"""How a vehicle is flown in offboard control: its capability table, asked form by form, and the method for tasks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.autopilot import autopilot
from app.domain.autopilot.capability import YES, FirmwareProfile, FlightKind, Support
from app.domain.errors import TaskRefusedError
from app.domain.offboard.messages import WIRE_FORMS, WireForm


@dataclass(frozen=True, slots=True)
class Capability:
    """One form for one vehicle: how it is sent, or why it is not."""

    form: str
    wire: WireForm
    support: Support


def capability(form: str, kind: FlightKind, profile: FirmwareProfile) -> Capability:
    """The table's word on one form. KeyError for a form that does not exist."""
    return Capability(form, WIRE_FORMS[form], autopilot().setpoints[kind][form].support(profile))


def capabilities(kind: FlightKind, profile: FirmwareProfile) -> tuple[Capability, ...]:
    """The whole column for one vehicle."""
    return tuple(capability(form, kind, profile) for form in WIRE_FORMS)


class ControlMethod(StrEnum):
    """`setpoints`: in OFFBOARD mode. `commands`: in Hold, moved by DO_REPOSITION and DO_ORBIT."""

    SETPOINTS = "setpoints"
    COMMANDS = "commands"


FORMS: Final[Mapping[FlightKind, tuple[str, ...]]] = {
    FlightKind.ROTARY: ("velocity_ned", "position_ned"),
    FlightKind.ROVER: ("velocity_ned", "position_ned"),
    FlightKind.WING: ("position_velocity_ned",),
    FlightKind.AIRSHIP: ("velocity_ned",),
}
"""The setpoint forms that a task is flown with."""
_ALWAYS_STREAMED: Final = Support("task.not_commanded", "it follows setpoints on every firmware")
_NO_CONTROLLER: Final = Support(
    "setpoint.vehicle_unsupported", "PX4 has an attitude controller for airships and none that flies to a place"
)
COMMANDED: Final[Mapping[FlightKind, Support]] = {
    FlightKind.ROTARY: _ALWAYS_STREAMED,
    FlightKind.ROVER: _ALWAYS_STREAMED,
    FlightKind.WING: YES,
    FlightKind.AIRSHIP: _NO_CONTROLLER,
}
"""Whether DO_REPOSITION and DO_ORBIT do what a task needs: flown with a plane on PX4 main, v1.13's source is alike."""


def task_control_method(kind: FlightKind, profile: FirmwareProfile) -> ControlMethod:
    """By setpoints where the vehicle follows all that tasks need, else by commands. Raises TaskRefusedError."""
    refused = [found for form in FORMS[kind] if not (found := capability(form, kind, profile)).support.is_accepted]
    if not refused:
        return ControlMethod.SETPOINTS
    commanded = COMMANDED[kind]
    if commanded.is_accepted:
        return ControlMethod.COMMANDS
    raise TaskRefusedError(
        f"tasks are flown with {refused[0].form}, which is not sent to {_a(kind)}: {refused[0].support.reason}; "
        f"nor by commands: {commanded.reason}",
        refusal=commanded.code,
        hint="send it there by a plan",
    )


def control_method_if_any(kind: FlightKind, profile: FirmwareProfile) -> ControlMethod | None:
    """As `task_control_method`; None where it refuses."""
    try:
        return task_control_method(kind, profile)
    except TaskRefusedError:
        return None


def _a(kind: FlightKind) -> str:
    return f"an {kind.value}" if kind is FlightKind.AIRSHIP else f"a {kind.value}"
