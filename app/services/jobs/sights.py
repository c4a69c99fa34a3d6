"""How the vehicles of the fleet stand for the queue: who has them, who flies them by hand, whether they may go on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from app.domain.jobs.readiness import VehicleSight
from app.domain.offboard.state import OffboardState
from app.domain.run import Run
from app.domain.run_filter import RunFilter
from app.services.fleet import Fleet, FleetVehicle
from app.services.jobs.book import JobBook
from app.services.runs import Runs


class VehicleSights:
    """Looks; the only thing that it changes is the queue of a vehicle whose newest run ended badly."""

    def __init__(self, fleet: Fleet, runs: Runs, book: JobBook) -> None:
        self._fleet = fleet
        self._runs = runs
        self._book = book

    def all(self) -> Sequence[VehicleSight]:
        """Every vehicle of the fleet, by id."""
        open_runs = self._open_runs()
        return [self._of(vehicle, open_runs, None) for vehicle in self._fleet.each()]

    def one(self, vehicle_id: str, own_run_id: str | None = None) -> VehicleSight:
        """One vehicle; that `own_run_id` has it does not count. Raises NotFoundError."""
        return self._of(self._fleet.vehicle(vehicle_id), self._open_runs(), own_run_id)

    def has(self, vehicle_id: str, run_id: str) -> bool:
        """Whether the run is followed on its vehicle. Raises NotFoundError."""
        return self._fleet.vehicle(vehicle_id).run_id == run_id

    async def newest_run(self, vehicle_id: str) -> Run | None:
        """The vehicle's newest run, whoever made it. Raises StorageError."""
        found = await self._runs.list_runs(1, RunFilter(vehicle_id=vehicle_id))
        return found[0] if found else None

    async def judge(self, vehicle_id: str, now: float) -> None:
        """Stop the vehicle's queue if its newest run ended badly and nobody said go on since. Raises StorageError."""
        newest = await self.newest_run(vehicle_id)
        await self._book.change_vehicle(vehicle_id, lambda queue: queue.judged(newest, now=now), "stopped")

    def _open_runs(self) -> Mapping[str, Sequence[str]]:
        """By vehicle. A run that an earlier process left has no vehicle yet, and its vehicle is taken all the same."""
        found: dict[str, list[str]] = {}
        for run in self._runs.open_runs():
            if not run.is_over:
                found.setdefault(run.vehicle_id, []).append(run.id)
        return found

    def _of(
        self, vehicle: FleetVehicle, open_runs: Mapping[str, Sequence[str]], own_run_id: str | None
    ) -> VehicleSight:
        queue = self._book.vehicle(vehicle.id)
        return VehicleSight(
            vehicle_id=vehicle.id,
            state=vehicle.link.state(),
            quarantined=vehicle.quarantined,
            held_by=self._holder(vehicle, open_runs.get(vehicle.id, ()), own_run_id),
            lease_holder=_lease_holder(vehicle),
            stopped=queue.reason if queue.stopped else None,
        )

    def _holder(self, vehicle: FleetVehicle, open_runs: Sequence[str], own_run_id: str | None) -> str | None:
        for run_id in (vehicle.run_id, *open_runs):
            if run_id is not None and run_id != own_run_id:
                return f"run {run_id}"
        job = self._book.queue.holder_of(vehicle.id)
        return None if job is None or (own_run_id is not None and job.run_id == own_run_id) else f"job {job.id}"


def _lease_holder(vehicle: FleetVehicle) -> str | None:
    """Who flies it by hand. On the way out of offboard control there may be no lease any more, and it still counts."""
    view = vehicle.offboard()
    if view is None:
        return None
    if view.lease is not None:
        return view.lease.holder
    return None if view.state is OffboardState.IDLE else "offboard control, which is ending,"
