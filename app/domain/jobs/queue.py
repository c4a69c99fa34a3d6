"""The unfinished jobs, ordered and bounded. Immutable: each change returns a new queue."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Literal

from app.domain.errors import JobQueueFullError
from app.domain.jobs.job import Job, JobState, why_bad
from app.domain.model import FrozenForm
from app.domain.reasons import Reason
from app.domain.run.run import Run
from app.domain.vehicle.state import VehicleType

MAX_WAITING: Final = 200
QueuePosition = Literal["first", "last"]


@dataclass(frozen=True)
class JobQueue:
    """All open jobs by ID. Waiting jobs are ordered by priority, then by creation or by the position that was set.

    Repeated queries are computed once: no slots, because of the cached properties.
    """

    jobs: Mapping[str, Job] = field(default_factory=dict)
    capacity: int = MAX_WAITING

    @cached_property
    def waiting(self) -> tuple[Job, ...]:
        """Jobs without a vehicle, the next one first."""
        queued = (job for job in self.jobs.values() if job.state is JobState.QUEUED)
        return tuple(sorted(queued, key=lambda job: job.place))

    @cached_property
    def active(self) -> tuple[Job, ...]:
        """Jobs that have a vehicle."""
        return tuple(job for job in self.jobs.values() if job.is_active)

    @cached_property
    def _holders(self) -> Mapping[str | None, Job]:
        return {job.vehicle_id: job for job in reversed(self.active)}

    def due(self, now: float) -> tuple[Job, ...]:
        """The jobs that may start now, in order. A job that is not due yet does not block others."""
        return tuple(job for job in self.waiting if job.is_due(now) and not job.is_late(now))

    def holder_of(self, vehicle_id: str) -> Job | None:
        return self._holders.get(vehicle_id)

    @cached_property
    def vehicle_ids(self) -> frozenset[str]:
        """The vehicles that jobs have, and those that waiting jobs name."""
        named = (vehicle_id for job in self.waiting for vehicle_id in job.selector.named)
        return frozenset((*named, *(job.vehicle_id for job in self.active if job.vehicle_id is not None)))

    @cached_property
    def _waiting_for(self) -> tuple[tuple[int, ...], Mapping[str, tuple[int, ...]]]:
        """Places among those that wait: of the jobs that any vehicle may get, and of those that name vehicles."""
        for_any: list[int] = []
        named: dict[str, list[int]] = {}
        for place, job in enumerate(self.waiting):
            if not job.selector.named:
                for_any.append(place)
            for vehicle_id in job.selector.named:
                named.setdefault(vehicle_id, []).append(place)
        return tuple(for_any), {vehicle_id: tuple(places) for vehicle_id, places in named.items()}

    def waiting_for(self, vehicle_id: str, vehicle_type: VehicleType | None) -> tuple[str, ...]:
        """The ids of the jobs that a vehicle may get, the next one first. Until its type is known, of all types."""
        for_any, named = self._waiting_for
        jobs = (self.waiting[place] for place in sorted((*for_any, *named.get(vehicle_id, ()))))
        return tuple(job.id for job in jobs if vehicle_type is None or job.vehicle_type is vehicle_type)

    def with_jobs(self, jobs: Iterable[Job]) -> JobQueue:
        """Return the queue with these jobs; those that have ended are removed."""
        merged = {**self.jobs, **{job.id: job for job in jobs}}
        return replace(self, jobs={key: job for key, job in merged.items() if not job.is_over})

    def last_rank(self) -> float:
        """The rank for one more job: behind all others of its priority."""
        return max((job.rank for job in self.jobs.values()), default=0) + 1

    def refuse_if_full(self) -> None:
        """Raises JobQueueFullError."""
        if len(self.waiting) >= self.capacity:
            raise JobQueueFullError(
                f"{self.capacity} jobs wait already, and there is no place for another",
                hint="cancel one that nobody needs, or wait until one has begun",
                capacity=self.capacity,
            )

    def added(self, job: Job) -> JobQueue:
        """With one more. Raises JobQueueFullError; nothing was changed."""
        self.refuse_if_full()
        return self.with_job(job)

    def with_job(self, job: Job) -> JobQueue:
        """Return the queue with this job; it is removed if it has ended."""
        jobs = {**self.jobs, job.id: job}
        if job.is_over:
            del jobs[job.id]
        return replace(self, jobs=jobs)

    def placed(self, job: Job, *, priority: int | None, place: QueuePosition | None, now: float) -> Job:
        """A waiting job first or last of those with its priority; with another priority and no place, last of those."""
        wanted = job.priority if priority is None else priority
        rank = job.rank
        if place == "first":
            same = (other.rank for other in self.jobs.values() if other.id != job.id and other.priority == wanted)
            rank = min(same, default=1) - 1
        elif place == "last" or wanted != job.priority:
            rank = self.last_rank()
        return job.changed(now=now, priority=wanted, rank=rank)

    def placed_before(self, job: Job, next_job: Job, *, now: float) -> tuple[Job, ...]:
        """A waiting job just before another one, with its priority. All jobs of that priority get whole ranks if no
        number is left between the two: returned are those that change.
        """
        if job.id == next_job.id:
            return ()
        same = [other for other in self.jobs.values() if other.id != job.id and other.priority == next_job.priority]
        same.sort(key=lambda other: other.rank)
        at = next(place for place, other in enumerate(same) if other.id == next_job.id)
        ahead = same[at - 1].rank if at else next_job.rank - 2
        rank = (ahead + next_job.rank) / 2
        moved = job.changed(now=now, priority=next_job.priority, rank=rank)
        if ahead < rank < next_job.rank:
            return (moved,)
        ordered = enumerate((*same[:at], moved, *same[at:]), start=1)
        return tuple(one.changed(now=now, rank=number) for number, one in ordered if one is moved or one.rank != number)


class VehicleQueue(FrozenForm):
    """While `stopped`, no job is begun and no start asked. `cleared_run_id`: a run whose end stops it no more."""

    vehicle_id: str
    stopped: bool = False
    reason: Reason | None = None
    actor: str = ""
    at: float | None = None
    cleared_run_id: str | None = None

    def judged(self, newest: Run | None, *, now: float) -> VehicleQueue:
        """Return the queue after the newest run of the vehicle, from any source: a run that ended badly stops it
        once.
        """
        if self.stopped or newest is None or not newest.is_over or newest.id == self.cleared_run_id:
            return self
        bad = why_bad(newest)
        return self if bad is None else self.stopped_by("waydrop", bad, now=now)

    def stopped_by(self, actor: str, reason: Reason, *, now: float) -> VehicleQueue:
        return self.model_copy(update={"stopped": True, "reason": reason, "actor": actor, "at": now})

    def resumed_by(self, actor: str, newest: Run | None, *, now: float) -> VehicleQueue:
        """Return the resumed queue, whatever the result of the newest run."""
        cleared = newest.id if newest is not None and newest.is_over else self.cleared_run_id
        given = {"stopped": False, "reason": None, "actor": actor, "at": now, "cleared_run_id": cleared}
        return self.model_copy(update=given)

    def cleared(self, run_id: str) -> VehicleQueue:
        """That run was taken off the vehicle by the queue itself: its end is no reason to stop."""
        return self.model_copy(update={"cleared_run_id": run_id})
