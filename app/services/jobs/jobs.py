"""All jobs: ordered, checked, listed, moved and cancelled; and the queues of vehicles, stopped and resumed."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Final

from app.domain.errors import JobNotTakenError, JobWrongStateError, NotFoundError, WaydropError
from app.domain.jobs.assignment import VehicleReadiness, chosen_of, hopeless, why_not_ready, why_unseen
from app.domain.jobs.job import TAKEN_WITHIN_S, Job, JobState
from app.domain.jobs.queue import JobQueue, VehicleQueue
from app.domain.ports.journal import EventJournal
from app.domain.ports.stores import ALL_JOBS, AnswerTo, JobFilter, JobStore
from app.domain.prediction import CALM
from app.domain.reasons import Reason, ReasonCode
from app.services.background import begin_task, end_tasks
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.jobs.assessment import Assessment
from app.services.jobs.availability import VehicleAvailability
from app.services.jobs.changes import JobChanges, parsed, refuse_past
from app.services.jobs.known_vehicles import KnownVehicles
from app.services.jobs.repository import JobRepository
from app.services.jobs.scheduler import JobScheduler
from app.services.jobs.time_slice import TimeSlice
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobSettings, JobUpdate, VehicleQueueView
from app.services.jobs.withdrawal import Withdrawal
from app.services.plans import Plans
from app.services.runs import Runs

SHOWN_WITHIN_S: Final = 0.2
"""So long the answer for a new job waits for vehicles to report their facts."""


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
        self._assessment = Assessment(fleet, settings.facts_s, plans.work)
        self._known = KnownVehicles(fleet, self._repository, store, runs)
        self._changes = JobChanges(self._repository, store, plans, clock)
        self._withdrawal = Withdrawal(runs, self._repository)
        parts = (self._repository, runs, plans, self._availability, self._assessment)
        self._scheduler = JobScheduler(*parts, clock, settings)
        self._task: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        """Go on where the last process stopped; after Runs.begin. Raises StorageError."""
        await self._repository.load()
        self._task = begin_task(self._scheduler.run(), "job scheduler")

    async def close(self) -> None:
        """Begin nothing more. Before Runs.close; what has begun is taken up at the next start. Idempotent."""
        await end_tasks(self._task)
        await self._assessment.close()

    async def create(self, request: JobRequest, actor: str, answer: AnswerTo[Job] | None = None) -> Job:
        """A new job in the queue, with its candidates if they are known soon; a plan that comes with it is stored
        first. `answer`: stored in the job's commit.

        Raises:
            NotFoundError, InvalidInputError, JobQueueFullError, PlanInvalid, PlanRejectedError, StorageError.
        """
        await self._known.require(*request.selector().named)
        job = await self._changes.create(request, actor, answer)
        try:
            return await self._with_candidates(job, SHOWN_WITHIN_S)
        except WaydropError:
            return job  # it is stored, whatever its vehicles say
        finally:
            self._scheduler.wake()

    async def check(self, request: JobRequest, facts_s: float | None = None) -> AssignmentView:
        """Which vehicle would get it now; nothing is stored. `facts_s`: see JobSettings.

        Raises NotFoundError, InvalidInputError, PlanInvalid, StorageError.
        """
        refuse_past(request, self._clock.now())
        await self._known.require(*request.selector().named)
        wind = CALM if request.wind is None else request.wind.wind()
        plan = await self._plans.plan(request.plan) if isinstance(request.plan, str) else await parsed(request)
        vehicles = await self._availability.all()
        candidates = await self._assessment.candidates(plan, request.selector(), vehicles, wind, facts_s)
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
        job = await self._changes.cancel(job_id, actor, self._withdrawal.withdraw)
        self._scheduler.wake()
        return job

    async def move(self, job_id: str, move: JobUpdate, actor: str) -> Job:
        return await self._changes.move(job_id, move, actor)

    async def clear_claim(self, job_id: str, actor: str) -> Job:
        """See JobsApi. No other gateway has jobs of this one."""
        job = await self.get(job_id)
        raise JobWrongStateError(
            f"job {job.id} was not given to a gateway by this Waydrop",
            hint="clear claims at an API node of the cluster",
            state=job.state.value,
        )

    async def take(self, given: Job) -> Job:
        """Take a job that the cluster gives to this gateway: it is stored, and then its run is made.

        Raises:
            JobNotTakenError: nothing is stored, and nothing will be. StorageError: it may be stored.
        """
        vehicle_id = given.vehicle_id or ""
        await self._availability.judge(vehicle_id, self._clock.now())
        job, is_new = await self._repository.settle(given, self._taken)
        if is_new:  # no await since it was stored: the scheduler has not seen it yet
            self._scheduler.make_run(job.id)
        elif job.fence > given.fence or job.state is JobState.RETURNED:
            raise JobNotTakenError(f"job {job.id} was given back before", hint="read the job again")
        return job

    async def claim_of(self, given: Job) -> Job:
        """The job as it was taken. If it did not come yet, it is stored that it comes too late. Raises StorageError."""
        never_came = Reason.of(ReasonCode.JOB_NEVER_CAME)
        job, _ = await self._repository.settle(given, lambda job: job.requeued(never_came, now=self._clock.now()))
        return job

    def _taken(self, job: Job) -> Job:
        if (age_s := self._clock.now() - job.updated_at) > TAKEN_WITHIN_S:
            raise JobNotTakenError(f"job {job.id} was given {age_s:.0f} s ago", hint="set all clocks by NTP")
        try:
            refusals = why_not_ready(self._availability.one(job.vehicle_id or ""))
        except NotFoundError as error:
            raise JobNotTakenError(error.detail, hint=error.hint) from error
        if refusals or job.claim is None:
            why = refusals[0].message if refusals else "it is given to no gateway"
            raise JobNotTakenError(f"vehicle {job.vehicle_id}: {why}", hint="read the job again")
        return job.changed(now=self._clock.now(), claim=job.claim.model_copy(update={"taken": True}))

    async def queues(self) -> JobQueuesView:
        """All waiting jobs, and the state of each vehicle's queue; of one that was not heard yet if it is stopped or
        there are jobs for it.
        """
        queue, time_slice, vehicles = self._repository.queue, TimeSlice(), []
        for vehicle in await self._availability.all():
            vehicles.append(self._vehicle_view(vehicle, queue))
            await time_slice.take()
        for vehicle_id in self._known.unseen():
            vehicles.append(self._unseen_view(vehicle_id, queue))
            await time_slice.take()
        return JobQueuesView(
            dispatching=self._task is not None and not self._task.done(),
            capacity=queue.capacity,
            waiting=queue.waiting,
            vehicles=tuple(vehicles),
        )

    async def stop(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """Begin and start nothing on this vehicle; a run that flies goes on. Raises NotFoundError, StorageError."""
        await self._known.require(vehicle_id)
        now, why = self._clock.now(), Reason.of(ReasonCode.QUEUE_STOPPED, actor=actor)

        def stopped(queue: VehicleQueue) -> VehicleQueue:
            return queue if queue.stopped else queue.stopped_by(actor, why, now=now)

        await self._repository.change_vehicle(vehicle_id, stopped, "stopped")
        self._withdrawal.hold_back(vehicle_id, why)
        return self._queue_view(vehicle_id)

    async def resume(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """An operator has looked at the vehicle: its queue goes on. Raises NotFoundError, StorageError."""
        await self._known.require(vehicle_id)
        newest, now = await self._availability.newest_run(vehicle_id), self._clock.now()

        def resumed(queue: VehicleQueue) -> VehicleQueue:
            stands = queue.judged(newest, now=now).stopped  # also before its newest run was checked
            return queue.resumed_by(actor, newest, now=now) if stands else queue

        await self._repository.change_vehicle(vehicle_id, resumed, "resumed")
        self._scheduler.wake()
        return self._queue_view(vehicle_id)

    async def _with_candidates(self, job: Job, facts_s: float | None = None) -> Job:
        if job.state is not JobState.QUEUED:
            return job
        candidates = await self._scheduler.candidates(job, facts_s)
        return job.model_copy(update={"candidates": candidates, "warning": hopeless(candidates)})

    def _queue_view(self, vehicle_id: str) -> VehicleQueueView:
        if self._known.is_seen(vehicle_id):
            return self._vehicle_view(self._availability.one(vehicle_id))
        return self._unseen_view(vehicle_id, self._repository.queue)

    def _unseen_view(self, vehicle_id: str, queue: JobQueue) -> VehicleQueueView:
        of_vehicle, holder = self._repository.vehicle(vehicle_id), queue.holder_of(vehicle_id)
        return VehicleQueueView(
            queue=of_vehicle,
            ready=False,
            refusals=why_unseen(of_vehicle.reason if of_vehicle.stopped else None),
            job_id=None if holder is None else holder.id,
            waiting=queue.waiting_for(vehicle_id, None),
        )

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
