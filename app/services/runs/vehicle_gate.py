"""A vehicle that cannot take a run now is refused: before anything is stored for it."""

from __future__ import annotations

from app.domain.arming import armed_by_others
from app.domain.errors import ConflictError, VehicleBusyError
from app.domain.ports import VehicleLink
from app.domain.run import Run
from app.domain.vehicle import LandedState
from app.services.fleet import FleetVehicle


def refuse_unfit_vehicle(vehicle: FleetVehicle, taken_by: str | None) -> None:
    """Raises VehicleBusyError, VehicleTakenError, ConflictError. `taken_by` is the run that has the vehicle."""
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
        raise armed_by_others(f"vehicle {vehicle.id}", state.mode)


def refuse_other_or_moving(run: Run, link: VehicleLink) -> None:
    """What is left of a run is flown from the ground, by the vehicle that has its parcels. Raises ConflictError."""
    uid = link.identity.uid
    if run.vehicle_uid is not None and uid is not None and uid != run.vehicle_uid:
        raise ConflictError(
            f"{run.vehicle_id} is another vehicle now: the parcels of run {run.id} are not on board",
            hint="post a plan of what is left as a new run",
        )
    if link.state().landed is not LandedState.ON_GROUND:
        raise ConflictError(f"vehicle {run.vehicle_id} is not known to stand on the ground", hint="land it first")
