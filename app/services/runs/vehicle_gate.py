"""A vehicle that is taken, not heard, or armed by somebody else gets no run."""

from __future__ import annotations

from app.domain.errors import ConflictError, VehicleBusyError
from app.services.fleet import FleetVehicle


def refuse_unfit_vehicle(vehicle: FleetVehicle, taken_by: str | None) -> None:
    """`taken_by`: the run that has it. Raises VehicleBusyError, ConflictError."""
    state = vehicle.link.state()
    if taken_by is not None:
        raise VehicleBusyError(
            f"vehicle {vehicle.id} already flies run {taken_by}",
            hint="wait until it is over; on the ground abort it, in the air return it",
            run_id=taken_by,
        )
    if not state.connected:
        raise ConflictError(f"the link to vehicle {vehicle.id} is lost", hint="wait until it is connected")
    if state.armed:
        raise ConflictError(
            f"vehicle {vehicle.id} is armed, and not by Waydrop", hint="land and disarm it first, then post the run"
        )
