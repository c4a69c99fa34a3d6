"""Who may arm a vehicle, and why it does not arm in a mode: it hardly says so itself, so the mode tells it."""

from __future__ import annotations

from app.domain.autopilot import autopilot
from app.domain.errors import VehicleTakenError
from app.domain.vehicle import FlightMode


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
