"""The jobs that are not over, in order and bounded. Immutable: each change gives the next queue."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from app.domain.errors import JobsFullError
from app.domain.jobs.job import Job, JobState

MAX_WAITING: Final = 200
Place = Literal["first", "last"]


@dataclass(frozen=True, slots=True)
class JobQueue:
    """All open jobs by id. Those that wait are ordered by priority, then as they came or were placed."""

    jobs: Mapping[str, Job] = field(default_factory=dict)
    capacity: int = MAX_WAITING

    @property
    def waiting(self) -> tuple[Job, ...]:
        """Jobs without a vehicle, the next one first."""
        queued = (job for job in self.jobs.values() if job.state is JobState.QUEUED)
        return tuple(sorted(queued, key=lambda job: job.place))

    @property
    def active(self) -> tuple[Job, ...]:
        """Jobs that have a vehicle."""
        return tuple(job for job in self.jobs.values() if job.is_active)

    def due(self, now: float) -> tuple[Job, ...]:
        """Those that may begin now, the next one first. One that is not due yet holds up nobody."""
        return tuple(job for job in self.waiting if job.is_due(now) and not job.is_late(now))

    def holder_of(self, vehicle_id: str) -> Job | None:
        """The job that has a vehicle."""
        return next((job for job in self.active if job.vehicle_id == vehicle_id), None)

    def last_rank(self) -> int:
        """The rank for one more job: behind all others of its priority."""
        return max((job.rank for job in self.jobs.values()), default=0) + 1

    def refuse_if_full(self) -> None:
        """Raises JobsFullError."""
        if len(self.waiting) >= self.capacity:
            raise JobsFullError(
                f"{self.capacity} jobs wait already, and there is no place for another",
                hint="cancel one that nobody needs, or wait until one has begun",
                capacity=self.capacity,
            )

    def added(self, job: Job) -> JobQueue:
        """With one more. Raises JobsFullError; nothing was changed."""
        self.refuse_if_full()
        return self.with_job(job)

    def with_job(self, job: Job) -> JobQueue:
        """With a job as it is now; one that is over leaves."""
        rest = {key: value for key, value in self.jobs.items() if key != job.id}
        return replace(self, jobs=rest if job.is_over else {**self.jobs, job.id: job})

    def placed(self, job: Job, *, priority: int | None, place: Place | None, now: float) -> Job:
        """A waiting job with another priority, or first or last of those with its priority."""
        wanted = job.priority if priority is None else priority
        ranks = [other.rank for other in self.jobs.values() if other.id != job.id and other.priority == wanted]
        rank = job.rank
        if place == "first":
            rank = min(ranks, default=1) - 1
        elif place == "last":
            rank = max([*ranks, self.last_rank() - 1]) + 1
        return job.changed(now=now, priority=wanted, rank=rank)
