"""What flies a vehicle, and the numbers of its modes: by its autopilot and type, as its HEARTBEAT tells them."""

from __future__ import annotations

from app.domain.autopilot import autopilot, autopilot_kind
from app.domain.mav_type import vehicle_type
from app.domain.vehicle import AutopilotKind, FlightMode
from app.vehicles.decoders import Heartbeat


def flown_by(beat: Heartbeat | None) -> AutopilotKind:
    """PX4 until a HEARTBEAT says who it is: of any other that Waydrop does not know nothing else is heard."""
    return (None if beat is None else autopilot_kind(beat.autopilot)) or AutopilotKind.PX4


def flight_mode(number: int, beat: Heartbeat | None) -> FlightMode:
    """The mode of a custom_mode."""
    return autopilot(flown_by(beat)).flight_mode(number, None if beat is None else vehicle_type(beat.type))


def mode_numbers(mode: FlightMode, beat: Heartbeat | None) -> tuple[int, int]:
    """DO_SET_MODE's param2 and param3 of a mode that Waydrop commands."""
    return autopilot(flown_by(beat)).mode_numbers(mode, None if beat is None else vehicle_type(beat.type))
