"""What dispatchers change in a queue: a new job, another place for it, its cancellation."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Sequence

from app.domain.errors import InvalidInputError, JobWrongStateError, NotFoundError
from app.domain.jobs.job import Job, JobState
from app.domain.plan import Plan, parse_data
from app.domain.ports.stores import AnswerTo, JobStore
from app.domain.reasons import Reason, ReasonCode
from app.services.clock import Clock
from app.services.jobs.repository import JobRepository
from app.services.jobs.views import JobRequest, JobUpdate
from app.services.plans import Plans


class JobChanges:
    """Of one queue: that of a gateway, or that of the jobs which several sites may fly."""

    def __init__(self, repository: JobRepository, store: JobStore, plans: Plans, clock: Clock) -> None:
        self._repository = repository
        self._store = store
        self._plans = plans
        self._clock = clock

    async def create(self, request: JobRequest, actor: str, answer: AnswerTo[Job] | None = None) -> Job:
        """A new job in the queue; a plan that comes with it is stored first. `answer`: stored in the job's commit.

        Raises:
            NotFoundError, InvalidInputError, JobQueueFullError, PlanInvalid, PlanRejectedError, StorageError.
        """
        refuse_past(request, self._clock.now())
        self._repository.queue.refuse_if_full()
        plan_id = (
            request.plan
            if isinstance(request.plan, str)
            else (await self._plans.create(await parsed(request), actor)).id
        )
        stored = await self._plans.stored(plan_id)
        plan = await self._plans.read(stored)
        now = self._clock.now()

        def make(rank: float) -> Job:
            return Job(
                id=f"job-{secrets.token_hex(6)}",
                plan_id=plan_id,
                plan_hash=stored.hash,
                plan_name=plan.name,
                vehicle_type=plan.vehicle_type,
                order_id=None if plan.order is None else plan.order.id,
                selector=request.selector(),
                wind=None if request.wind is None else request.wind.wind(),
                not_before=None if request.not_before is None else request.not_before.timestamp(),
                deadline=None if request.deadline is None else request.deadline.timestamp(),
                auto_start=request.auto_start,
                priority=request.priority,
                rank=rank,
                requested_by=actor,
                created_at=now,
                updated_at=now,
            )

        return await self._repository.add(make, actor, answer)

    async def cancel(self, job_id: str, actor: str, check: Callable[[Job], None] = lambda job: None) -> Job:
        """End a job that does not fly; a run that waits on its vehicle is taken off, and the job ends with it.

        `check` is called with the job as it is then, just before the end is stored: whoever takes the run off does so
        there, so that it cannot start meanwhile.

        Raises:
            NotFoundError, StorageError. JobWrongStateError: its run was started, or it has ended. Whatever `check`
            raises.
        """

        def cancelled(job: Job) -> Job:
            check(job)
            return _cancelled(job, actor, self._clock.now())

        await self._refuse_if_over(job_id)
        return await self._repository.change(job_id, cancelled, actor)

    async def move(self, job_id: str, move: JobUpdate, actor: str) -> Job:
        """Another place for a job that waits. Raises NotFoundError, JobWrongStateError, StorageError."""

        def placed(job: Job) -> Sequence[Job]:
            queue = self._repository.queue
            next_job = None if move.before is None else queue.jobs.get(move.before)
            if move.before is not None and next_job is None:
                raise NotFoundError(f"no open job {move.before!r}", hint="list the open jobs for their ids")
            for one in (job, next_job):
                if one is not None and one.state is not JobState.QUEUED:
                    raise _wrong(one, "is already assigned to a vehicle")
            if next_job is not None:
                return queue.placed_before(job, next_job, now=self._clock.now())
            return (queue.placed(job, priority=move.priority, place=move.place, now=self._clock.now()),)

        await self._refuse_if_over(job_id)
        return await self._repository.move(job_id, placed, actor)

    async def _refuse_if_over(self, job_id: str) -> None:
        if job_id in self._repository.queue.jobs:
            return
        job = await self._store.get(job_id)
        if job is None:
            raise NotFoundError(f"no job {job_id!r}", hint="list the jobs to see their IDs")
        raise _wrong(job, "was given back to the cluster" if job.state is JobState.RETURNED else "is over")


def refuse_past(request: JobRequest, now: float) -> None:
    """Raises InvalidInputError if it cannot begin at any time."""
    deadline, not_before = request.deadline, request.not_before
    if deadline is not None and deadline.timestamp() <= now:
        raise InvalidInputError("the deadline has passed", hint="the deadline is the latest time to start")
    if deadline is not None and not_before is not None and deadline <= not_before:
        raise InvalidInputError("the deadline is not after not_before", hint="the deadline is the latest time to start")


async def parsed(request: JobRequest) -> Plan:
    return await asyncio.to_thread(parse_data, request.plan)


def _cancelled(job: Job, actor: str, now: float) -> Job:
    reason = Reason.of(ReasonCode.JOB_CANCELLED, actor=actor)
    if job.state is JobState.QUEUED:
        return job.moved_to(JobState.CANCELLED, now=now, reason=reason)
    if job.state is JobState.FLYING:
        raise _wrong(job, f"is flying: return or abort its run {job.run_id}")
    return job if job.end_requested else job.changed(now=now, end_requested="cancelled", reason=reason)


def _wrong(job: Job, why: str) -> JobWrongStateError:
    return JobWrongStateError(f"job {job.id} {why}", hint="get the job to see its state", state=job.state.value)
