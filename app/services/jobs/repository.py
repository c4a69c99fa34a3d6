"""The repository of open jobs, equal in memory and on disk. A change is stored with its event before it takes
effect.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Literal

from app.domain.errors import JobNotTakenError, NotFoundError
from app.domain.events import NewEvent
from app.domain.events.service import JobChanged, JobQueueChanged
from app.domain.jobs.job import Job, change_word
from app.domain.jobs.queue import JobQueue, VehicleQueue
from app.domain.ports.journal import EventJournal
from app.domain.ports.stores import AnswerTo, JobFilter, JobRecord, JobStore
from app.services.clock import Clock

MOST_OPEN = 10_000
WAYDROP = "waydrop"
"""The actor of changes that nobody requested."""


class JobRepository:
    """Changes are serialized. A caller passes a function that gets the job as it is at that time.

    `is_fenced`: other processes may change the same jobs, so each change here raises their fencing number.
    """

    def __init__(
        self, store: JobStore, journal: EventJournal, clock: Clock, capacity: int, *, is_fenced: bool = False
    ) -> None:
        self.queue = JobQueue(capacity=capacity)
        self._fence_step = 1 if is_fenced else 0
        self._vehicles: dict[str, VehicleQueue] = {}
        self._store = store
        self._journal = journal
        self._clock = clock
        self._turn = asyncio.Lock()

    async def load(self) -> None:
        """Read what is stored, by an earlier process or by others. Raises StorageError."""
        async with self._turn:
            jobs = await self._store.list_jobs(JobFilter(open_only=True), limit=MOST_OPEN)
            self.queue = JobQueue(capacity=self.queue.capacity).with_jobs(jobs)
            self._vehicles = {queue.vehicle_id: queue for queue in await self._store.list_queues()}

    def vehicle(self, vehicle_id: str) -> VehicleQueue:
        return self._vehicles.get(vehicle_id) or VehicleQueue(vehicle_id=vehicle_id)

    def has_vehicle(self, vehicle_id: str) -> bool:
        """Whether its queue was ever stopped or cleared, or an open job has or names it."""
        return vehicle_id in self._vehicles or vehicle_id in self.queue.vehicle_ids

    def vehicle_ids(self) -> frozenset[str]:
        """The vehicles whose queues are stopped, and those that open jobs have or name."""
        stopped = (queue.vehicle_id for queue in self._vehicles.values() if queue.stopped)
        return self.queue.vehicle_ids.union(stopped)

    async def add(self, make: Callable[[float], Job], actor: str, answer: AnswerTo[Job] | None = None) -> Job:
        """A new job; `make` gets its rank. `answer`: stored in the same commit. Raises JobQueueFullError,
        StorageError.
        """
        async with self._turn:
            job = self._fenced(make(self.queue.last_rank()))
            queue = self.queue.added(job)
            answers = () if answer is None else (answer(job),)
            await self._journal.record(self._job_event(None, job, actor), jobs=(job,), answers=answers)
            self.queue = queue
            return job

    async def change(
        self,
        job_id: str,
        step: Callable[[Job], Job],
        actor: str = WAYDROP,
        *,
        also: Callable[[Job, Job, VehicleQueue], VehicleQueue] | None = None,
    ) -> Job:
        """The open job after `step`; stored if it differs, together with what `also` makes of its vehicle's queue:
        it gets the job before and after, and the queue.

        Raises:
            NotFoundError: it is not open. StorageError: it is as it was. Whatever `step` raises.
        """
        async with self._turn:
            before = self._open(job_id)
            job = step(before)
            if job == before:
                return before
            job = self._fenced(job)
            events, records = [self._job_event(before, job, actor)], list[JobRecord]([job])
            queue = None if also is None or job.vehicle_id is None else also(before, job, self.vehicle(job.vehicle_id))
            if queue is not None and queue != self.vehicle(queue.vehicle_id):
                events.append(self._queue_event(queue, "stopped" if queue.stopped else "cleared"))
                records.append(queue)
            await self._journal.record(*events, jobs=records)
            self.queue = self.queue.with_job(job)
            if queue is not None:
                self._vehicles[queue.vehicle_id] = queue
            return job

    async def move(self, job_id: str, step: Callable[[Job], Sequence[Job]], actor: str) -> Job:
        """The open job after `step`, which returns all jobs that it changes; they are stored together.

        Raises:
            NotFoundError: it is not open. StorageError: all are as they were. Whatever `step` raises.
        """
        async with self._turn:
            jobs = [self._fenced(job) for job in step(self._open(job_id))]
            if jobs:
                events = [self._job_event(self.queue.jobs[job.id], job, actor) for job in jobs]
                await self._journal.record(*events, jobs=jobs)
                self.queue = self.queue.with_jobs(jobs)
            return self.queue.jobs[job_id]

    async def settle(self, given: Job, step: Callable[[Job], Job]) -> tuple[Job, bool]:
        """A job that the cluster has given to this gateway, as `step` makes it, and True.

        As it is stored, and False, if this claim or a newer one was stored before.

        Raises:
            StorageError: it may be stored all the same. JobNotTakenError: an earlier claim of it went on here, and was
            cleared meanwhile. Whatever `step` raises.
        """
        async with self._turn:
            stored = self.queue.jobs.get(given.id) or await self._store.get(given.id)
            if stored is not None and stored.fence >= given.fence:
                return stored, False
            if stored is not None and not stored.was_never_begun:
                raise JobNotTakenError(
                    f"this gateway has had job {given.id} before, and it is {stored.state.value} here",
                    hint=f"see run {stored.run_id} at this gateway",
                )
            job = step(given)
            await self._journal.record(self._job_event(given, job, WAYDROP), jobs=(job,))
            self.queue = self.queue.with_job(job)
            return job, True

    async def reopen(self, given: Job, step: Callable[[Job], Job], actor: str = WAYDROP) -> Job:
        """A job that a gateway has or gave back, after `step`.

        Raises ConflictError: it was changed meanwhile. StorageError. Whatever `step` raises.
        """
        async with self._turn:
            job = self._fenced(step(given))
            await self._journal.record(self._job_event(given, job, actor), jobs=(job,))
            self.queue = self.queue.with_job(job)
            return job

    async def change_vehicle(
        self, vehicle_id: str, step: Callable[[VehicleQueue], VehicleQueue], change: Literal["stopped", "resumed"]
    ) -> VehicleQueue:
        """The queue of a vehicle after `step`; stored if it differs. Raises StorageError."""
        async with self._turn:
            before = self.vehicle(vehicle_id)
            queue = step(before)
            if queue != before:
                await self._journal.record(self._queue_event(queue, change), jobs=(queue,))
                self._vehicles[vehicle_id] = queue
            return queue

    def _fenced(self, job: Job) -> Job:
        return job.model_copy(update={"fence": job.fence + self._fence_step})

    def _open(self, job_id: str) -> Job:
        job = self.queue.jobs.get(job_id)
        if job is None:
            raise NotFoundError(f"no open job {job_id!r}", hint="list the open jobs to see their IDs")
        return job

    def _job_event(self, before: Job | None, job: Job, actor: str) -> NewEvent:
        vehicle_id = job.vehicle_id or (before.vehicle_id if before is not None else None)
        changed = JobChanged(change=change_word(before, job), actor=actor, job=job)
        return self._journal.new_event(changed, vehicle_id=vehicle_id)

    def _queue_event(self, queue: VehicleQueue, change: Literal["stopped", "resumed", "cleared"]) -> NewEvent:
        return self._journal.new_event(JobQueueChanged(change=change, queue=queue), vehicle_id=queue.vehicle_id)
