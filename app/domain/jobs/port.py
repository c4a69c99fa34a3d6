"""Where jobs are kept: storage/. They are written with the events that tell of them (EventStore.append)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from app.domain.jobs.job import Job, JobState
from app.domain.jobs.vehicle_queue import VehicleQueue

JobRecord = Job | VehicleQueue
"""What an event of jobs may change."""


@dataclass(frozen=True, slots=True)
class JobFilter:
    """Every condition that is given must hold. `vehicle_id`: it has the job, had it, or is the one that is wished.

    `older_than` is the id of a job: only those stored before it, for the next page.
    """

    vehicle_id: str | None = None
    plan_id: str | None = None
    states: frozenset[JobState] = frozenset()
    open_only: bool = False
    older_than: str | None = None


ALL_JOBS: Final = JobFilter()


class JobStore(Protocol):
    """Jobs as last stored. Each method may raise StorageError."""

    async def get(self, job_id: str) -> Job | None:
        """One job."""

    async def list_jobs(self, wanted: JobFilter, *, limit: int) -> Sequence[Job]:
        """Newest first."""

    async def list_queues(self) -> Sequence[VehicleQueue]:
        """The queues of which anything was ever recorded, by vehicle."""
