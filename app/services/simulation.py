"""The simulated vehicles, where there are any: how they truly are, and their faults on request."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict

from app.domain.errors import SimulatorNotRunningError, SimulatorRefusedError, SimulatorSilentError, WaydropError
from app.domain.events import EventKind
from app.domain.simulated_faults import FAULT_KINDS, Fault, FaultKind
from app.domain.simulator import SimulatedVehicle, SimulatorControl
from app.services.fleet import Fleet, FleetVehicle
from app.services.journal import Journal


class SimulatedVehicleView(SimulatedVehicle):
    """A simulated vehicle as it truly is. `vehicle_id` is what it is called here, null before it was seen."""

    vehicle_id: str | None


class SimulatorView(BaseModel):
    """`available`: faults can be set now; else `reason` says why not. `faults` are all that the simulator knows."""

    model_config = ConfigDict(frozen=True)

    available: bool
    reason: str | None
    vehicles: list[SimulatedVehicleView]
    faults: list[FaultKind]


class FaultSet(BaseModel):
    """The fault that was set, and of which vehicles."""

    model_config = ConfigDict(frozen=True)

    fault: str
    value: Any
    vehicle_ids: list[str]


class Simulation:
    """`control` is None where no simulator is configured: then there is nothing to see, and no fault to set."""

    def __init__(self, control: SimulatorControl | None, fleet: Fleet, journal: Journal) -> None:
        self._control = control
        self._fleet = fleet
        self._journal = journal

    async def view(self) -> SimulatorView:
        """Always an answer: that there is no simulator, or that it is silent, is told in it."""
        try:
            vehicles = await self._required().vehicles()
        except (SimulatorNotRunningError, SimulatorSilentError) as error:
            return SimulatorView(available=False, reason=error.detail, vehicles=[], faults=list(FAULT_KINDS))
        shown = [
            SimulatedVehicleView(**vehicle.model_dump(), vehicle_id=next(iter(self._known(vehicle.system_id)), None))
            for vehicle in vehicles
        ]
        return SimulatorView(available=True, reason=None, vehicles=shown, faults=list(FAULT_KINDS))

    async def set_fault(self, fault: Fault, by: str) -> FaultSet:
        """Record the fault, then set it.

        Raises:
            SimulatorNotRunningError, SimulatorSilentError: no simulator is there, or it does not answer.
            NotFoundError: no such vehicle was seen.
            SimulatorRefusedError: the vehicle is not a simulated one, or cannot have this fault.
            StorageError: it could not be recorded; it is not set.
        """
        control = self._required()
        chosen = None if fault.vehicle is None else self._fleet.vehicle(fault.vehicle)
        simulated = {vehicle.system_id for vehicle in await control.vehicles()}
        system_id = None if chosen is None else chosen.link.identity.system_id
        if system_id is not None and system_id not in simulated:
            raise SimulatorRefusedError(f"vehicle {fault.vehicle} is no simulated vehicle")
        hit = [key for number in sorted(simulated) for key in self._known(number)] if chosen is None else [chosen.id]
        await self._record(hit, fault, by, problem=None)
        try:
            await control.set_fault(fault.fault, fault.value, system_id=system_id)
        except WaydropError as error:
            await self._record(hit, fault, by, problem=error.detail)
            raise
        return FaultSet(fault=fault.fault, value=fault.value, vehicle_ids=hit)

    def _required(self) -> SimulatorControl:
        if self._control is None:
            raise SimulatorNotRunningError(
                "this service was started without simulated vehicles",
                hint="`waydrop up` starts both; or set WAYDROP_SIMULATOR_CONTROL to the simulator's control socket",
            )
        return self._control

    def _known(self, system_id: int) -> Sequence[str]:
        """The ids of the vehicles seen with this system id."""
        return [view.id for view in self._fleet.vehicles() if view.system_id == system_id]

    async def _record(self, vehicle_ids: Sequence[str], fault: Fault, by: str, *, problem: str | None) -> None:
        """One event for each vehicle, in its run's story; one without a vehicle if none was seen yet."""
        vehicles: list[FleetVehicle | None] = [self._fleet.vehicle(key) for key in vehicle_ids]
        events = [
            self._journal.new_event(
                EventKind.SIMULATOR_FAULT,
                vehicle_id=None if vehicle is None else vehicle.id,
                run_id=None if vehicle is None else vehicle.run_id,
                fault=fault.fault,
                value=fault.value,
                by=by,
                problem=problem,
            )
            for vehicle in vehicles or [None]
        ]
        await self._journal.record(*events)
