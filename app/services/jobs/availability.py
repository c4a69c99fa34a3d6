"""The availability of the fleet's vehicles for jobs: who uses or controls them, and whether their queues run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from app.domain.jobs.assignment import (
    VehicleReadiness,
)
from app.domain.jobs.job import was_broken_off
from app.domain.offboard.state import OffboardState
from app.domain.ports.stores import RunFilter
from app.domain.run.run import Run
from app.services.fleet import Fleet, FleetVehicle
from app.services.jobs.repository import JobRepository
from app.services.jobs.time_slice import TimeSlice
from app.services.runs import Runs

EARLIER_AT_ONCE: Final = 20
"""Runs that are read together once the newest one was broken off."""


class VehicleAvailability:
    """Looks; the only thing that it changes is the queue of a vehicle whose newest run ended badly."""

    def __init__(self, fleet: Fleet, runs: Runs, repository: JobRepository) -> None:
        self._fleet = fleet
        self._runs = runs
        self._repository = repository

    async def all(self) -> Sequence[VehicleReadiness]:
        """Every vehicle of the fleet, by id; the loop turns in between, so one may be out of date: see `one`."""
        time_slice, open_runs, found = TimeSlice(), self._open_runs(), list[VehicleReadiness]()
        for vehicle in tuple(self._fleet.each()):
            found.append(self._of(vehicle, open_runs, None))
            await time_slice.take()
        return found

    def one(self, vehicle_id: str, own_run_id: str | None = None) -> VehicleReadiness:
        """One vehicle; that `own_run_id` has it does not count. Raises NotFoundError."""
        return self._of(self._fleet.vehicle(vehicle_id), self._open_runs(), own_run_id)

    def has(self, vehicle_id: str, run_id: str) -> bool:
        """Whether the run is followed on its vehicle. Raises NotFoundError."""
        return self._fleet.vehicle(vehicle_id).run_id == run_id

    async def newest_run(self, vehicle_id: str) -> Run | None:
        """The newest run of the vehicle that tells what it carries, from any source: one that a restart broke off
        before its start hides nothing of the run before it. Raises StorageError.
        """
        cleared_id, limit, older_than = self._repository.vehicle(vehicle_id).cleared_run_id, 1, None
        while found := await self._runs.list_runs(limit, RunFilter(vehicle_id=vehicle_id, older_than=older_than)):
            for run in found:
                if run.id == cleared_id or not was_broken_off(run):
                    return run
            limit, older_than = EARLIER_AT_ONCE, found[-1].id
        return None

    async def judge(self, vehicle_id: str, now: float) -> None:
        """Stop the queue of the vehicle if its newest run, see `newest_run`, ended badly and no operator resumed it
        since. Raises StorageError.
        """
        newest = await self.newest_run(vehicle_id)
        await self._repository.change_vehicle(vehicle_id, lambda queue: queue.judged(newest, now=now), "stopped")

    def _open_runs(self) -> Mapping[str, Sequence[str]]:
        """By vehicle. A run that an earlier process left is not assigned to a vehicle object yet, but its vehicle is
        busy.
        """
        found: dict[str, list[str]] = {}
        for run in self._runs.open_runs():
            if not run.is_over:
                found.setdefault(run.vehicle_id, []).append(run.id)
        return found

    def _of(
        self, vehicle: FleetVehicle, open_runs: Mapping[str, Sequence[str]], own_run_id: str | None
    ) -> VehicleReadiness:
        queue = self._repository.vehicle(vehicle.id)
        return VehicleReadiness(
            vehicle_id=vehicle.id,
            state=vehicle.link.state(),
            quarantined=vehicle.quarantined,
            held_by=self._holder(vehicle, open_runs.get(vehicle.id, ()), own_run_id),
            lease_holder=_lease_holder(vehicle),
            stopped=queue.reason if queue.stopped else None,
            no_new_work=self._fleet.why_no_new_work(),
        )

    def _holder(self, vehicle: FleetVehicle, open_runs: Sequence[str], own_run_id: str | None) -> str | None:
        for run_id in (vehicle.run_id, *open_runs):
            if run_id is not None and run_id != own_run_id:
                return f"run {run_id}"
        job = self._repository.queue.holder_of(vehicle.id)
        return None if job is None or (own_run_id is not None and job.run_id == own_run_id) else f"job {job.id}"


def _lease_holder(vehicle: FleetVehicle) -> str | None:
    """The holder of offboard control. While leaving there may be no lease any more; it still counts."""
    view = vehicle.offboard()
    if view is None:
        return None
    if view.lease is not None:
        return view.lease.holder
    return None if view.state is OffboardState.IDLE else "a client whose offboard control is ending"
