"""What an autopilot takes in offboard control: the kinds of flight, and a verdict for each setpoint form."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from app.domain.vehicle.state import VehicleType, VtolState

# The parameter audit before offboard control: what the vehicle does by itself when the stream stops.


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One parameter. `blocks`: offboard control is not entered while it is so. `value` None: it did not answer."""

    parameter: str
    value: float | None
    blocks: bool
    meaning: str


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


YES: Final = Verdict()


class Cell(NamedTuple):
    """Of the table: what the autopilot's documents say, and what was flown."""

    documented: Verdict
    flown: Verdict

    def verdict(self, profile: FirmwareProfile) -> Verdict:
        """What counts for firmware of this profile."""
        if profile is FirmwareProfile.FLOWN or (profile is FirmwareProfile.UNSURE and not self.flown.is_taken):
            return self.flown
        return self.documented


def flight_kind(vehicle_type: VehicleType, vtol_state: VtolState | None) -> FlightKind:
    """What the vehicle flies like now. A VTOL in transition, or that says nothing, counts as a wing."""
    if vehicle_type is VehicleType.VTOL:
        return FlightKind.ROTARY if vtol_state is VtolState.MULTICOPTER else FlightKind.WING
    return {
        VehicleType.MULTICOPTER: FlightKind.ROTARY,
        VehicleType.FIXED_WING: FlightKind.WING,
        VehicleType.ROVER: FlightKind.ROVER,
        VehicleType.AIRSHIP: FlightKind.AIRSHIP,
    }[vehicle_type]
