"""The vehicles that may have jobs: those heard since the start, and those that were in use before it."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.errors import NotFoundError
from app.domain.jobs.assignment import by_number
from app.domain.ports.stores import JobFilter, JobStore, RunFilter
from app.services.fleet import Fleet
from app.services.jobs.repository import JobRepository
from app.services.runs import Runs


class KnownVehicles:
    """After a restart a vehicle that is off is not in the fleet, but its queue and its jobs are on disk.

    Somebody must be able to stop its queue before it is switched on.
    """

    def __init__(self, fleet: Fleet, repository: JobRepository, store: JobStore, runs: Runs) -> None:
        self._fleet = fleet
        self._repository = repository
        self._store = store
        self._runs = runs

    def is_seen(self, vehicle_id: str) -> bool:
        """Whether it was heard since the start."""
        try:
            self._fleet.vehicle(vehicle_id)
        except NotFoundError:
            return False
        return True

    def unseen(self) -> Sequence[str]:
        """Those not heard since the start whose queue is stopped, or for which there are jobs."""
        return [one for one in sorted(self._repository.vehicle_ids(), key=by_number) if not self.is_seen(one)]

    async def require(self, *vehicle_ids: str) -> None:
        """Raises NotFoundError: one was never heard, or nothing that is stored tells of it. StorageError."""
        for vehicle_id in vehicle_ids:
            if not self.is_seen(vehicle_id) and not await self._was_used(vehicle_id):
                self._fleet.vehicle(vehicle_id)

    async def _was_used(self, vehicle_id: str) -> bool:
        if self._repository.has_vehicle(vehicle_id):
            return True
        if await self._runs.list_runs(1, RunFilter(vehicle_id=vehicle_id)):
            return True
        jobs = await self._store.list_jobs(JobFilter(vehicle_id=vehicle_id), limit=1)
        return any(job.vehicle_id == vehicle_id for job in jobs)
