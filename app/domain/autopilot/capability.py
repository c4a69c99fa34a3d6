"""Offboard capabilities of an autopilot: flight regimes, and whether each setpoint form is followed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from app.domain.vehicle.state import VehicleType, VtolState


@dataclass(frozen=True, slots=True)
class AuditedParameter:
    """An audited parameter. `blocks`: it prevents offboard control. `value` None: the vehicle did not answer.

    `doubtful`: it does not prevent it, but the vehicle reacts late to a failure, or not at all.
    """

    parameter: str
    value: float | None
    blocks: bool
    meaning: str
    doubtful: bool = False


class FirmwareProfile(StrEnum):
    """The column of the capability table. Between versions, and with unknown firmware, only what both follow is
    accepted.
    """

    DOCUMENTED = "documented"
    FLOWN = "flown"
    UNSURE = "unsure"


class FlightKind(StrEnum):
    """Vehicles that follow the same rules. A VTOL belongs to one or the other by its state."""

    ROTARY = "rotary"
    WING = "wing"
    ROVER = "rover"
    AIRSHIP = "airship"


@dataclass(frozen=True, slots=True)
class Support:
    """A cell of the table: accepted if `code` is empty, else rejected with this code and reason."""

    code: str = ""
    reason: str = ""

    @property
    def is_accepted(self) -> bool:
        """Whether the form may be sent."""
        return not self.code


YES: Final = Support()


class Cell(NamedTuple):
    """The columns of the table: the autopilot's documentation, and test flights."""

    documented: Support
    flown: Support

    def support(self, profile: FirmwareProfile) -> Support:
        if profile is FirmwareProfile.FLOWN or (profile is FirmwareProfile.UNSURE and not self.flown.is_accepted):
            return self.flown
        return self.documented


def flight_kind(vehicle_type: VehicleType, vtol_state: VtolState | None) -> FlightKind:
    """Return the current kind. A VTOL in transition, or with unknown state, counts as fixed wing."""
    if vehicle_type is VehicleType.VTOL:
        return FlightKind.ROTARY if vtol_state is VtolState.MULTICOPTER else FlightKind.WING
    return {
        VehicleType.MULTICOPTER: FlightKind.ROTARY,
        VehicleType.FIXED_WING: FlightKind.WING,
        VehicleType.ROVER: FlightKind.ROVER,
        VehicleType.AIRSHIP: FlightKind.AIRSHIP,
    }[vehicle_type]
