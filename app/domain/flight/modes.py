"""Flight modes: who commanded the mode that a vehicle is in, and in which modes it can be armed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from app.domain.autopilot import autopilot
from app.domain.errors import VehicleTakenError
from app.domain.vehicle.state import FlightMode, VehicleState

# Who may arm a vehicle, and why it does not arm in a mode: it hardly says so itself, so the mode tells it.


def arming_obstacle(mode: FlightMode | None) -> str:
    """What keeps a disarmed vehicle in this mode from arming, in words; empty if the mode does not."""
    why = "" if mode is None else autopilot().arming_obstacle(mode)
    return f"the vehicle is disarmed in {name_of(mode)} mode, and {why}" if why else ""


def hold_hint(vehicle_id: str) -> str:
    """How a disarmed vehicle leaves such a mode: each start tells it to hold, so something keeps it there."""
    return (
        "end what keeps it there (a stick, a switch, another ground station), and start again; "
        f"with its run aborted, `waydrop hold {vehicle_id}` tries it too"
    )


def armed_by_others(vehicle: str, mode: FlightMode | None) -> VehicleTakenError:
    """Of a vehicle that is armed, and nobody here has armed it. `vehicle` is how it is called."""
    return VehicleTakenError(
        f"{vehicle} is armed in {name_of(mode)} mode, and not by Waydrop: a pilot or another ground station has it",
        hint="whoever has it lands and disarms it, then start again; with its run aborted, Waydrop can land it too",
        mode=None if mode is None else mode.value,
        armed=True,
    )


def disarmed_by_others(mode: FlightMode | None, hint: str = "start again once it is yours") -> VehicleTakenError:
    """Of a disarmed vehicle that was told to hold, and is in another mode."""
    return VehicleTakenError(
        arming_obstacle(mode) or f"the vehicle was put into {name_of(mode)} mode, and not by Waydrop",
        hint=hint,
        mode=None if mode is None else mode.value,
        armed=False,
    )


def taken_meanwhile(mode: FlightMode | None) -> VehicleTakenError:
    """Of a vehicle whose mode changed while another one was commanded."""
    return VehicleTakenError(
        f"the vehicle is in {name_of(mode)} mode meanwhile: a pilot, another ground station or a failsafe has it",
        hint="look at its mode and texts; command it again once it is yours",
        mode=None if mode is None else mode.value,
    )


def name_of(mode: FlightMode | None) -> str:
    """A mode in a sentence."""
    if mode is None or mode is FlightMode.OTHER:
        return "an unknown"
    return mode.value.upper()


# Who commanded the mode a vehicle is in, as far as its messages tell.
#
# A mode and its failsafe come together, in a HEARTBEAT or in a CURRENT_MODE (by the intended mode; without it the
# failsafe comes with the next HEARTBEAT). MISSION_CURRENT (the plan's own return or end) comes up to a second before
# or after: nobody is named before all of them have had time.


CAUSE_TOLD_S: Final = 2.5
"""HEARTBEAT and MISSION_CURRENT come at 1 Hz, and one may be lost."""


@dataclass(frozen=True, slots=True)
class ModeTracker:
    """`since_s`: when this mode was first seen; `by_failsafe`: one was seen in it, also if it has ended since."""

    mode: FlightMode | None = None
    since_s: float = 0.0
    by_failsafe: bool = False

    def seen(self, state: VehicleState, now_s: float) -> ModeTracker:
        """The sign after a look at a connected vehicle."""
        if state.mode is not self.mode:
            return ModeTracker(state.mode, now_s, state.in_failsafe)
        return replace(self, by_failsafe=True) if state.in_failsafe and not self.by_failsafe else self

    def is_settled(self, now_s: float) -> bool:
        """Whether what would tell of the mode's cause has had its time."""
        return now_s - self.since_s > CAUSE_TOLD_S
