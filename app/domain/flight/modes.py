"""Flight modes: who commanded the current mode, and in which modes a vehicle can be armed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from app.domain.autopilot import autopilot
from app.domain.errors import VehicleTakenError
from app.domain.vehicle.state import FlightMode, VehicleState


def arming_obstacle(mode: FlightMode | None) -> str:
    """Return what keeps a disarmed vehicle from arming in this mode; empty if nothing does."""
    why = "" if mode is None else autopilot().arming_obstacle(mode)
    return f"the vehicle is disarmed in {name_of(mode)} mode; {why}" if why else ""


def takes_off_as_it_arms(state: VehicleState) -> bool:
    """Whether a disarmed vehicle is in a mode in which PX4 takes off as soon as anybody arms it (flown)."""
    return state.connected and state.armed is False and state.mode in (FlightMode.MISSION, FlightMode.TAKEOFF)


def hold_hint(vehicle_id: str) -> str:
    """How to leave such a mode. Each start commands Hold, so something prevents that."""
    return (
        "stop what keeps it in this mode (a stick, a switch, another ground station), then start again; "
        f"after aborting the run, you can also use `waydrop hold {vehicle_id}`"
    )


def armed_by_others(vehicle: str, mode: FlightMode | None) -> VehicleTakenError:
    """Return the error for a vehicle that no start of Waydrop armed. `vehicle` is its name in the message."""
    return VehicleTakenError(
        f"{vehicle} is armed in {name_of(mode)} mode, not by this start: a pilot or another ground station controls "
        "it, or it stayed armed after its last flight",
        hint="whoever controls it must land and disarm it before you start again; after an abort, Waydrop can land it",
        mode=None if mode is None else mode.value,
        armed=True,
    )


def disarmed_by_others(
    mode: FlightMode | None, hint: str = "start again when no other client controls it"
) -> VehicleTakenError:
    """Return the error for a disarmed vehicle that was commanded to hold but is in another mode."""
    return VehicleTakenError(
        arming_obstacle(mode) or f"the vehicle was switched to {name_of(mode)} mode, not by Waydrop",
        hint=hint,
        mode=None if mode is None else mode.value,
        armed=False,
    )


def disarmed_meanwhile(mode: FlightMode | None, texts: Sequence[str] = ()) -> VehicleTakenError:
    """Return the error for a vehicle that was armed for its mission and reports disarmed, but not by Waydrop. `texts`
    are those in which it may say why.
    """
    what = "the vehicle was disarmed again, not by Waydrop: by a pilot, another ground station or itself"
    return VehicleTakenError(
        "; ".join((what, *texts)),
        hint="start again when no other client controls it",
        mode=None if mode is None else mode.value,
        armed=False,
        texts=tuple(texts),
    )


def taken_meanwhile(mode: FlightMode | None, texts: Sequence[str] = ()) -> VehicleTakenError:
    """Return the error for a vehicle whose mode changed while another one was commanded. `texts`: as above."""
    what = f"the vehicle is now in {name_of(mode)} mode: a pilot, another ground station or a failsafe controls it"
    return VehicleTakenError(
        "; ".join((what, *texts)),
        hint="check its mode and messages, and repeat the command when no other client controls it",
        mode=None if mode is None else mode.value,
        texts=tuple(texts),
    )


def name_of(mode: FlightMode | None) -> str:
    """Return the name of a mode for messages."""
    if mode is None or mode is FlightMode.OTHER:
        return "an unknown"
    return mode.value.upper()


# Who commanded the current mode, as far as messages show.
#
# Mode and failsafe arrive together, in HEARTBEAT or CURRENT_MODE (by the intended mode; without it, the failsafe
# arrives with the next HEARTBEAT). MISSION_CURRENT (return or end of the plan) arrives up to a second earlier or later.
# No cause is named before all of them could have arrived.


CAUSE_REPORTED_S: Final = 2.5
"""HEARTBEAT and MISSION_CURRENT are sent at 1 Hz, and one may be lost."""


@dataclass(frozen=True, slots=True)
class ModeTracker:
    """`since_s`: when this mode was first observed; `by_failsafe`: a failsafe was active in it at some time.

    `has_returned`: it was in Return mode since it was last in Mission mode, and MISSION_CURRENT may be where that led.
    """

    mode: FlightMode | None = None
    since_s: float = 0.0
    by_failsafe: bool = False
    has_returned: bool = False

    def seen(self, state: VehicleState, now_s: float) -> ModeTracker:
        """Return the cause after an observation of a connected vehicle."""
        if state.mode is not self.mode:
            returns = state.mode is FlightMode.RETURN or (self.has_returned and state.mode is not FlightMode.MISSION)
            return ModeTracker(state.mode, now_s, state.in_failsafe, returns)
        return replace(self, by_failsafe=True) if state.in_failsafe and not self.by_failsafe else self

    def is_settled(self, now_s: float) -> bool:
        """Whether all messages about the cause of the mode could have arrived."""
        return now_s - self.since_s > CAUSE_REPORTED_S
