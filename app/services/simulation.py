"""The simulated vehicles, where there are any: how they truly are, their faults and their speed on request."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from app.domain.drop.record import DropPhase
from app.domain.errors import (
    SimulatorNotRunningError,
    SimulatorRefusedError,
    SimulatorSilentError,
    StorageError,
    WaydropError,
)
from app.domain.events.service import SimulatorFault, SimulatorSpeedSet
from app.domain.model import Frozen
from app.domain.ports.simulated_vehicles import (
    FAULT_KINDS,
    MAX_SPEED,
    Fault,
    FaultKind,
    SimulatedVehicle,
    SimulatorControl,
    SimulatorSpeed,
)
from app.domain.run.run import NOT_STARTED, Run, RunState
from app.domain.vehicle.clock import MAX_LIVE_RATE
from app.services.fleet import Fleet, FleetVehicle
from app.services.journal import Journal
from app.services.runs import Runs
from app.services.views import VehicleView


def refuse_unsafe_speed(speed: float, runs: Sequence[Run], vehicles: Sequence[VehicleView]) -> None:
    """`runs` are the open runs of these simulated vehicles.

    Raises:
        SimulatorRefusedError: the decision on a release is pending; or the speed is above MAX_LIVE_RATE and a mission
        change is in progress, a started run has a supervised drop ahead, or a client has the offboard lease of a
        vehicle.
    """
    supervised = [run for run in runs if run.state not in NOT_STARTED and _has_supervised_drop_ahead(run)]
    for run in supervised:
        if run.state is RunState.AT_DROP:
            raise SimulatorRefusedError(
                f"run {run.id} is at a drop of vehicle {run.vehicle_id}, whose hold depends on this speed",
                hint="wait until the drop has ended",
            )
    if speed <= MAX_LIVE_RATE:
        return
    for run in runs:
        if run.changing is not None:
            raise SimulatorRefusedError(
                f"the mission of run {run.id} is being changed and may add a supervised drop",
                hint=f"wait until the change has ended, or use {MAX_LIVE_RATE:g} or less",
            )
    for run in supervised:
        raise SimulatorRefusedError(
            f"run {run.id} of vehicle {run.vehicle_id} has a supervised drop ahead, "
            f"and those work up to {MAX_LIVE_RATE:g} times real time",
            hint=f"wait until the run ends, or use {MAX_LIVE_RATE:g} or less",
        )
    for vehicle in vehicles:
        lease = None if vehicle.state.offboard is None else vehicle.state.offboard.lease
        if lease is not None:
            raise SimulatorRefusedError(
                f"vehicle {vehicle.id} is controlled by {lease.holder}, "
                f"and offboard control is available up to {MAX_LIVE_RATE:g} times real time",
                hint=f"wait until the lease is released, or use {MAX_LIVE_RATE:g} or less",
            )


def _has_supervised_drop_ahead(run: Run) -> bool:
    return any(drop.supervised and drop.phase is not DropPhase.DONE for drop in run.drops)


class SimulatedVehicleView(SimulatedVehicle):
    """The true state of a simulated vehicle. `vehicle_id` is its ID in Waydrop, null before it connected."""

    vehicle_id: str | None


class SpeedView(SimulatorSpeed):
    """`live`: at this speed supervised drops and OFFBOARD work. Above `live_max` they are refused."""

    live: bool
    live_max: float = MAX_LIVE_RATE
    max: float = MAX_SPEED

    @classmethod
    def of(cls, speed: SimulatorSpeed) -> SpeedView:
        """With the limits for supervised drops and offboard control."""
        return cls(**speed.model_dump(), live=speed.wanted <= MAX_LIVE_RATE)


class SimulatorView(Frozen):
    """`available`: faults can be set now; else `reason` says why not. `configured`: the service has a simulator, which
    may answer later. `faults` are all that the simulator knows. `speed` is null while it is not available.
    """

    configured: bool
    available: bool
    reason: str | None
    vehicles: list[SimulatedVehicleView]
    faults: list[FaultKind]
    speed: SpeedView | None


class FaultSet(Frozen):
    """The fault that was set, and of which vehicles."""

    fault: str
    value: Any
    vehicle_ids: list[str]


class Simulation:
    """`control` is None where no simulator is configured: then there is nothing to see, and no fault to set."""

    def __init__(self, control: SimulatorControl | None, fleet: Fleet, runs: Runs, journal: Journal) -> None:
        self._control = control
        self._fleet = fleet
        self._runs = runs
        self._journal = journal

    async def view(self) -> SimulatorView:
        """Always returns: the view says if there is no simulator, or if it does not answer."""
        try:
            state = await self._required().state()
        except (SimulatorNotRunningError, SimulatorSilentError) as error:
            return SimulatorView(
                configured=self._control is not None,
                available=False,
                reason=error.detail,
                vehicles=[],
                faults=list(FAULT_KINDS),
                speed=None,
            )
        shown = [
            SimulatedVehicleView(**vehicle.model_dump(), vehicle_id=next(iter(self._known(vehicle.system_id)), None))
            for vehicle in state.vehicles
        ]
        speed = SpeedView.of(state.speed)
        return SimulatorView(
            configured=True, available=True, reason=None, vehicles=shown, faults=list(FAULT_KINDS), speed=speed
        )

    async def set_fault(self, fault: Fault, actor: str) -> FaultSet:
        """Record the fault, then set it.

        Raises:
            SimulatorNotRunningError, SimulatorSilentError: no simulator is there, or it does not answer.
            NotFoundError: no such vehicle was seen.
            SimulatorRefusedError: the vehicle is not a simulated one, or cannot have this fault.
            StorageError: it could not be recorded; it is not set.
        """
        control = self._required()
        chosen = None if fault.vehicle is None else self._fleet.vehicle(fault.vehicle)
        simulated = {vehicle.system_id for vehicle in (await control.state()).vehicles}
        system_id = None if chosen is None else chosen.link.identity.system_id
        if system_id is not None and system_id not in simulated:
            raise SimulatorRefusedError(f"vehicle {fault.vehicle} is not a simulated vehicle")
        hit = [key for number in sorted(simulated) for key in self._known(number)] if chosen is None else [chosen.id]
        await self._record(hit, fault, actor, problem=None)
        try:
            await control.set_fault(fault.fault, fault.value, system_id=system_id)
        except WaydropError as error:
            await self._record(hit, fault, actor, problem=error.detail)
            raise
        return FaultSet(fault=fault.fault, value=fault.value, vehicle_ids=hit)

    async def set_speed(self, speed: float, actor: str) -> SpeedView:
        """Record the speed, then change it, also in flight.

        The clock of each vehicle is measured again from before the request: a start that is checked meanwhile waits for
        it.

        Raises:
            SimulatorNotRunningError, SimulatorSilentError: there is no simulator, or it does not respond.
            SimulatorRefusedError: a supervised drop or offboard control prevents it.
            StorageError: it could not be recorded; it is not changed.
        """
        control = self._required()
        before = await control.state()
        known = [self._fleet.vehicle(key) for one in before.vehicles for key in self._known(one.system_id)]
        ids = {vehicle.id for vehicle in known}
        runs = [run for run in self._runs.open_runs() if run.vehicle_id in ids]
        refuse_unsafe_speed(speed, runs, [vehicle.view() for vehicle in known])
        _set_clock_rate(known, speed)  # nothing is awaited between the check of the runs and this
        try:
            await self._record_speed(speed, actor, problem=None)
            reached = await self._ordered(control, speed, actor)
        except (StorageError, SimulatorRefusedError):
            _set_clock_rate(known, before.speed.wanted)
            raise
        _set_clock_rate(known, reached.wanted)  # messages received in between may be from the previous speed
        return SpeedView.of(reached)

    async def _ordered(self, control: SimulatorControl, speed: float, actor: str) -> SimulatorSpeed:
        try:
            return await control.set_speed(speed)
        except WaydropError as error:
            await self._record_speed(speed, actor, problem=error.detail)
            raise

    async def _record_speed(self, speed: float, actor: str, *, problem: str | None) -> None:
        await self._journal.record(
            self._journal.new_event(SimulatorSpeedSet(speed=speed, actor=actor, problem=problem))
        )

    def _required(self) -> SimulatorControl:
        if self._control is None:
            raise SimulatorNotRunningError(
                "this service was started without simulated vehicles",
                hint="`waydrop up` starts both; or set WAYDROP_SIMULATOR_CONTROL to the simulator's control socket",
            )
        return self._control

    def _known(self, system_id: int) -> Sequence[str]:
        """The IDs of the vehicles with this system ID."""
        return [view.id for view in self._fleet.vehicles() if view.system_id == system_id]

    async def _record(self, vehicle_ids: Sequence[str], fault: Fault, actor: str, *, problem: str | None) -> None:
        """One event for each vehicle, in its run's story; one without a vehicle if none was seen yet."""
        vehicles: list[FleetVehicle | None] = [self._fleet.vehicle(key) for key in vehicle_ids]
        events = [
            self._journal.new_event(
                SimulatorFault(fault=fault.fault, value=fault.value, actor=actor, problem=problem),
                vehicle_id=None if vehicle is None else vehicle.id,
                run_id=None if vehicle is None else vehicle.run_id,
            )
            for vehicle in vehicles or [None]
        ]
        await self._journal.record(*events)


def _set_clock_rate(vehicles: Sequence[FleetVehicle], rate: float) -> None:
    for vehicle in vehicles:
        vehicle.link.set_clock_rate(rate)
