"""What stands against a change of the simulated time's speed: work that is decided by our clock, right now."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.drop import DropPhase
from app.domain.errors import SimulatorRefusedError
from app.domain.live_control import MAX_LIVE_RATE
from app.domain.run import NOT_STARTED, Run, RunState
from app.services.views import VehicleView


def refuse_unsafe_speed(speed: float, runs: Sequence[Run], vehicles: Sequence[VehicleView]) -> None:
    """`runs` are the open ones of these simulated vehicles.

    Raises:
        SimulatorRefusedError: a release waits to be decided; or the speed is above MAX_LIVE_RATE and a mission is being
            changed, a supervised drop is still to come in a run that was started, or somebody has a vehicle's offboard
            lease.
    """
    supervised = [run for run in runs if run.state not in NOT_STARTED and _has_supervised_drop_ahead(run)]
    for run in supervised:
        if run.state is RunState.AT_DROP:
            raise SimulatorRefusedError(
                f"run {run.id} is at a drop of vehicle {run.vehicle_id}, whose hold is counted at this speed",
                hint="wait until the drop is over",
            )
    if speed <= MAX_LIVE_RATE:
        return
    for run in runs:
        if run.changing is not None:
            raise SimulatorRefusedError(
                f"the mission of run {run.id} is being changed, and may bring a supervised drop",
                hint=f"wait until the change is over, or take {MAX_LIVE_RATE:g} or less",
            )
    for run in supervised:
        raise SimulatorRefusedError(
            f"run {run.id} of vehicle {run.vehicle_id} has a supervised drop before it, "
            f"and those work up to {MAX_LIVE_RATE:g} times real time",
            hint=f"wait until the run is over, or take {MAX_LIVE_RATE:g} or less",
        )
    for vehicle in vehicles:
        lease = None if vehicle.state.offboard is None else vehicle.state.offboard.lease
        if lease is not None:
            raise SimulatorRefusedError(
                f"vehicle {vehicle.id} is in the hands of {lease.holder}, "
                f"and by hand it is flown up to {MAX_LIVE_RATE:g} times real time",
                hint=f"wait until the lease is given back, or take {MAX_LIVE_RATE:g} or less",
            )


def _has_supervised_drop_ahead(run: Run) -> bool:
    return any(drop.supervised and drop.phase is not DropPhase.DONE for drop in run.drops)
