"""All jobs: ordered, checked, listed, moved and cancelled; and the queues of vehicles, stopped and resumed."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Sequence

import structlog

from app.domain.errors import InvalidInputError, JobWrongStateError, NotFoundError
from app.domain.jobs.assignment import VehicleReadiness, chosen_of, hopeless, why_not_ready
from app.domain.jobs.job import Job, JobState
from app.domain.jobs.queue import JobQueue, VehicleQueue
from app.domain.plan import Plan, parse_data
from app.domain.ports.journal import EventJournal
from app.domain.ports.stores import ALL_JOBS, JobFilter, JobStore
from app.domain.prediction import CALM
from app.domain.reasons import Reason, ReasonCode
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.jobs.availability import Assessment, TimeSlice, VehicleAvailability
from app.services.jobs.repository import JobRepository
from app.services.jobs.scheduler import JobScheduler
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobSettings, JobUpdate, VehicleQueueView
from app.services.plans import Plans
from app.services.runs import Runs

log = structlog.get_logger(__name__)


class Jobs:
    """The API of the queue. What a method promises is stored when it returns; the scheduler acts on it in a task of
    its own.
    """

    def __init__(
        self,
        store: JobStore,
        plans: Plans,
        runs: Runs,
        fleet: Fleet,
        journal: EventJournal,
        clock: Clock,
        settings: JobSettings | None = None,
    ) -> None:
        settings = settings or JobSettings()
        self._store = store
        self._plans = plans
        self._fleet = fleet
        self._clock = clock
        self._repository = JobRepository(store, journal, clock, settings.capacity)
        self._availability = VehicleAvailability(fleet, runs, self._repository)
        self._assessment = Assessment(fleet, settings.facts_s)
        parts = (self._repository, runs, plans, self._availability, self._assessment)
        self._scheduler = JobScheduler(*parts, clock, settings)
        self._task: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        """Go on where the last process stopped; after Runs.begin. Raises StorageError."""
        await self._repository.load()
        self._task = asyncio.create_task(self._scheduler.run(), name="job scheduler")
        self._task.add_done_callback(_log_defect)

    async def close(self) -> None:
        """Begin nothing more. Before Runs.close; what has begun is taken up at the next start. Idempotent."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        await self._assessment.close()

    async def create(self, order: JobRequest, actor: str) -> Job:
        """A new job in the queue, with its candidates as they are now; a plan that comes with it is stored first.

        Raises:
            NotFoundError, InvalidInputError, JobQueueFullError, PlanInvalid, PlanRejectedError, StorageError.
        """
        self._refuse_unusable(order)
        self._repository.queue.refuse_if_full()
        plan_id = (
            order.plan if isinstance(order.plan, str) else (await self._plans.create(await _parsed(order), actor)).id
        )
        plan = await self._plans.plan(plan_id)
        now = self._clock.now()

        def make(rank: float) -> Job:
            return Job(
                id=f"job-{secrets.token_hex(6)}",
                plan_id=plan_id,
                plan_name=plan.name,
                vehicle_type=plan.vehicle_type,
                order_id=None if plan.order is None else plan.order.id,
                selector=order.selector(),
                wind=None if order.wind is None else order.wind.wind(),
                not_before=None if order.not_before is None else order.not_before.timestamp(),
                deadline=None if order.deadline is None else order.deadline.timestamp(),
                auto_start=order.auto_start,
                priority=order.priority,
                rank=rank,
                requested_by=actor,
                created_at=now,
                updated_at=now,
            )

        job = await self._repository.add(make, actor)
        shown = await self._with_candidates(job)
        self._scheduler.wake()
        return shown

    async def check(self, order: JobRequest) -> AssignmentView:
        """Which vehicle would get it now; nothing is stored. Raises NotFoundError, PlanInvalid, StorageError."""
        self._refuse_unseen(order)
        wind = CALM if order.wind is None else order.wind.wind()
        plan = await self._plans.plan(order.plan) if isinstance(order.plan, str) else await _parsed(order)
        candidates = await self._assessment.candidates(plan, order.selector(), await self._availability.all(), wind)
        chosen = chosen_of(candidates)
        chosen_id = None if chosen is None else chosen.vehicle_id
        return AssignmentView(vehicle_id=chosen_id, candidates=candidates, warning=hopeless(candidates))

    async def get(self, job_id: str) -> Job:
        """One job; of one that waits the candidates as they are now. Raises NotFoundError, StorageError."""
        job = self._repository.queue.jobs.get(job_id) or await self._store.get(job_id)
        if job is None:
            raise NotFoundError(f"no job {job_id!r}", hint="list the jobs to see their IDs")
        return await self._with_candidates(job)

    async def list_jobs(self, limit: int, wanted: JobFilter = ALL_JOBS) -> Sequence[Job]:
        """Newest first. Raises NotFoundError if `wanted.older_than` is no job, StorageError."""
        if wanted.older_than is not None and await self._store.get(wanted.older_than) is None:
            raise NotFoundError(f"no job {wanted.older_than!r}", hint="list the jobs to see their IDs")
        return await self._store.list_jobs(wanted, limit=limit)

    async def cancel(self, job_id: str, actor: str) -> Job:
        """End a job that does not fly; a run that waits on its vehicle is taken off, and the job ends with it.

        Raises:
            NotFoundError, StorageError. JobWrongStateError: its run was started, or it has ended.
        """
        await self._refuse_if_over(job_id)
        job = await self._repository.change(
            job_id, lambda current: _cancelled(current, actor, self._clock.now()), actor
        )
        self._scheduler.wake()
        return job

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

    async def queues(self) -> JobQueuesView:
        """All waiting jobs, and the state of each vehicle's queue."""
        queue, breath, vehicles = self._repository.queue, TimeSlice(), []
        for vehicle in await self._availability.all():
            vehicles.append(self._vehicle_view(vehicle, queue))
            await breath.take()
        return JobQueuesView(
            dispatching=self._task is not None and not self._task.done(),
            capacity=queue.capacity,
            waiting=queue.waiting,
            vehicles=tuple(vehicles),
        )

    async def stop(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """Begin and start nothing on this vehicle; a run that flies goes on. Raises NotFoundError, StorageError."""
        self._fleet.vehicle(vehicle_id)
        now = self._clock.now()

        def stopped(queue: VehicleQueue) -> VehicleQueue:
            return (
                queue
                if queue.stopped
                else queue.stopped_by(actor, Reason.of(ReasonCode.QUEUE_STOPPED, actor=actor), now=now)
            )

        await self._repository.change_vehicle(vehicle_id, stopped, "stopped")
        return self._vehicle_view(self._availability.one(vehicle_id))

    async def resume(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """An operator has looked at the vehicle: its queue goes on. Raises NotFoundError, StorageError."""
        self._fleet.vehicle(vehicle_id)
        newest, now = await self._availability.newest_run(vehicle_id), self._clock.now()

        def resumed(queue: VehicleQueue) -> VehicleQueue:
            stands = queue.judged(newest, now=now).stopped  # also before its newest run was checked
            return queue.resumed_by(actor, newest, now=now) if stands else queue

        await self._repository.change_vehicle(vehicle_id, resumed, "resumed")
        self._scheduler.wake()
        return self._vehicle_view(self._availability.one(vehicle_id))

    async def _refuse_if_over(self, job_id: str) -> None:
        if job_id not in self._repository.queue.jobs:
            raise _wrong(await self.get(job_id), "is over")

    async def _with_candidates(self, job: Job) -> Job:
        if job.state is not JobState.QUEUED:
            return job
        candidates = await self._scheduler.candidates(job)
        return job.model_copy(update={"candidates": candidates, "warning": hopeless(candidates)})

    def _vehicle_view(self, vehicle: VehicleReadiness, queue: JobQueue | None = None) -> VehicleQueueView:
        queue = queue or self._repository.queue
        holder, refusals = queue.holder_of(vehicle.vehicle_id), why_not_ready(vehicle)
        vehicle_type = self._fleet.vehicle(vehicle.vehicle_id).link.identity.vehicle_type
        return VehicleQueueView(
            queue=self._repository.vehicle(vehicle.vehicle_id),
            ready=not refusals,
            refusals=refusals,
            job_id=None if holder is None else holder.id,
            waiting=queue.waiting_for(vehicle.vehicle_id, vehicle_type),
        )

    def _refuse_unseen(self, order: JobRequest) -> None:
        for vehicle_id in order.selector().named:
            self._fleet.vehicle(vehicle_id)

    def _refuse_unusable(self, order: JobRequest) -> None:
        self._refuse_unseen(order)
        deadline, not_before = order.deadline, order.not_before
        if deadline is not None and deadline.timestamp() <= self._clock.now():
            raise InvalidInputError("the deadline has passed", hint="the deadline is the latest time to start")
        if deadline is not None and not_before is not None and deadline <= not_before:
            raise InvalidInputError(
                "the deadline is not after not_before", hint="the deadline is the latest time to start"
            )


async def _parsed(order: JobRequest) -> Plan:
    return await asyncio.to_thread(parse_data, order.plan)


def _cancelled(job: Job, actor: str, now: float) -> Job:
    reason = Reason.of(ReasonCode.JOB_CANCELLED, actor=actor)
    if job.state is JobState.QUEUED:
        return job.moved_to(JobState.CANCELLED, now=now, reason=reason)
    if job.state is JobState.FLYING:
        raise _wrong(job, f"is flying: return or abort its run {job.run_id}")
    return job if job.end_requested else job.changed(now=now, end_requested="cancelled", reason=reason)


def _wrong(job: Job, why: str) -> JobWrongStateError:
    return JobWrongStateError(f"job {job.id} {why}", hint="get the job to see its state", state=job.state.value)


def _log_defect(task: asyncio.Task[None]) -> None:
    if not task.cancelled() and (error := task.exception()) is not None:
        log.error("the job scheduler failed: no job is started until Waydrop restarts", exc_info=error)
