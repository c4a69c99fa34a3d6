"""The scheduler: polls the queue, and assigns each due job to a suitable vehicle."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Sequence
from contextlib import suppress
from typing import Final

import structlog

from app.domain.errors import ConflictError, NotFoundError, WaydropError, WrongStateError
from app.domain.jobs.assignment import chosen_of, why_not_ready
from app.domain.jobs.job import Candidate, Job, JobState, VehicleSelector, after, must_be_taken_off
from app.domain.jobs.queue import VehicleQueue
from app.domain.prediction import CALM, Wind
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import Run, RunState
from app.services.clock import Clock
from app.services.jobs.availability import Assessment, TimeSlice, VehicleAvailability
from app.services.jobs.repository import JobRepository
from app.services.jobs.views import JobSettings
from app.services.plans import Plans
from app.services.runs import Runs
from app.services.runs.recorder import new_run_id

# Follows the jobs that have a vehicle: takes runs off it that are not to fly, and starts those that may start.


EXPIRED = Reason.of(ReasonCode.JOB_EXPIRED)


class _NotNowError(ConflictError):
    """The conditions that were checked before a start have changed."""

    def __init__(self, why: Reason) -> None:
        super().__init__("the run cannot be started now")
        self.why = why


class JobFollower:
    """Follows one job at a time. A start is stored as requested first and never requested again: after a restart of
    Waydrop an operator decides.
    """

    def __init__(self, repository: JobRepository, runs: Runs, availability: VehicleAvailability, clock: Clock) -> None:
        self._repository = repository
        self._runs = runs
        self._availability = availability
        self._clock = clock

    async def follow(self, job: Job) -> None:
        """Poll once. Raises StorageError, and the errors of starting or ending the run."""
        run = await self._run_of(job)
        now = self._clock.now()
        if run is not None and must_be_taken_off(job, run, now):
            await self._take_off(job, run)
            return
        job = await self._repository.change(
            job.id,
            lambda current: after(current, run, self._clock.now()),
            also=lambda changed, queue: self._judged(job, changed, run, queue),
        )
        if run is not None and run.state is RunState.UPLOADED and _may_be_started(job):
            await self._start(job, run)

    async def note_unknown_start(self, job: Job) -> None:
        """After a restart of Waydrop: record for a run that was being started that it is not started again
        automatically.
        """
        if job.state is JobState.PREPARED and job.start_requested_at is not None:
            await self._note(job, Reason.of(ReasonCode.JOB_START_UNKNOWN))

    def _judged(self, before: Job, job: Job, run: Run | None, queue: VehicleQueue) -> VehicleQueue:
        if run is None or not job.is_over:
            return queue
        taken_off = before.end_requested and job.state in (JobState.CANCELLED, JobState.EXPIRED)
        return queue.cleared(run.id) if taken_off else queue.judged(run, now=self._clock.now())

    async def _run_of(self, job: Job) -> Run | None:
        try:
            return await self._runs.get(job.run_id or "")
        except NotFoundError:
            return None

    async def _take_off(self, job: Job, run: Run) -> None:
        """End the run on the ground; one that a person starts at this moment is let go, and the next look finds it."""
        if not job.end_requested:
            asked = {"end_requested": "expired", "reason": EXPIRED}
            job = await self._repository.change(job.id, lambda current: current.changed(now=self._clock.now(), **asked))
        with suppress(WrongStateError):
            await self._runs.end_unstarted(run.id)

    async def _start(self, job: Job, run: Run) -> None:
        if not self._availability.has(run.vehicle_id, run.id) or job.is_late(self._clock.now()):
            return
        if why := self._why_unready(run):
            await self._note(job, why)
            return
        asked = await self._repository.change(job.id, self._asked)
        if asked.start_requested_at is None:
            return  # it was cancelled meanwhile
        try:
            await self._runs.start(run.id, last_look=lambda: self._check_again(job.id, run))
        except _NotNowError as error:
            why = error.why
            await self._repository.change(job.id, lambda current: _unasked(current, why, self._clock.now()))
        except WaydropError as error:
            await self._note(asked, Reason.of_error(error.code, error.detail))

    def _asked(self, job: Job) -> Job:
        now = self._clock.now()
        return job.changed(now=now, start_requested_at=now, reason=None) if _may_be_started(job) else job

    def _check_again(self, job_id: str, run: Run) -> None:
        """The disk, the vehicle's facts and the rules took their time: all that could forbid the start, once more."""
        job = self._repository.queue.jobs.get(job_id)
        if job is None or job.state is not JobState.PREPARED or job.end_requested:
            raise _NotNowError(Reason.of(ReasonCode.JOB_IS_TO_END))
        why = EXPIRED if job.is_late(self._clock.now()) else self._why_unready(run)
        if why is not None:
            raise _NotNowError(why)

    def _why_unready(self, run: Run) -> Reason | None:
        refusals = why_not_ready(self._availability.one(run.vehicle_id, run.id))
        if not refusals:
            return None
        first = refusals[0]
        return Reason.of(ReasonCode.JOB_NOT_READY, first.reason, code=first.code, refusal=first.message)

    async def _note(self, job: Job, reason: Reason) -> None:
        await self._repository.change(job.id, lambda current: _because(current, reason, self._clock.now()))


def _because(job: Job, reason: Reason, now: float) -> Job:
    return job if job.reason == reason else job.changed(now=now, reason=reason)


def _unasked(job: Job, reason: Reason, now: float) -> Job:
    """It was not started after all, and may be later. Of a job that is to end, the reason of that stays."""
    return job.changed(now=now, start_requested_at=None, reason=job.reason if job.end_requested else reason)


def _may_be_started(job: Job) -> bool:
    wanted = job.auto_start and job.state is JobState.PREPARED
    return wanted and job.start_requested_at is None and not job.end_requested


log = structlog.get_logger(__name__)
SEEN_FOR_S: Final = 0.5
"""How long a pass uses its snapshot of the vehicles."""


class JobScheduler:
    """One task. `look` is one pass: follow assigned jobs, expire late ones, assign due ones."""

    def __init__(
        self,
        repository: JobRepository,
        runs: Runs,
        plans: Plans,
        availability: VehicleAvailability,
        assessment: Assessment,
        clock: Clock,
        settings: JobSettings,
    ) -> None:
        self._repository = repository
        self._runs = runs
        self._plans = plans
        self._availability = availability
        self._assessment = assessment
        self._clock = clock
        self._settings = settings
        self._follower = JobFollower(repository, runs, availability, clock)
        self._woken = asyncio.Event()
        self._not_before_s: dict[str, float] = {}
        self._unmade: set[str] = set()

    def wake(self) -> None:
        """Wake the scheduler: something changed."""
        self._not_before_s.clear()
        self._woken.set()

    def make_run(self, job_id: str) -> None:
        """Make the run of a job that has its vehicle already. After a restart, one without a run is given back."""
        self._unmade.add(job_id)
        self.wake()

    async def run(self) -> None:
        """Poll until cancelled."""
        for job in self._repository.queue.active:
            await self._logging_errors(self._follower.note_unknown_start(job), job)
        while True:
            self._woken.clear()
            await self.look()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(self._settings.poll_every_s):
                    await self._woken.wait()

    async def look(self) -> None:
        """One pass. What fails is logged, and tried again at a later one."""
        breath = TimeSlice()
        for job in self._repository.queue.active:
            await self._logging_errors(self._advance(job), job)
            await breath.take()
        now = self._clock.now()
        for job in self._repository.queue.waiting:
            if job.is_late(now):
                await self._logging_errors(self._expire(job), job)
        await breath.take()
        due = [job for job in self._repository.queue.due(now) if self._may_be_tried(job)]
        if due and await self._judge_ready(breath):
            await self._give_out(due, breath)
        self._not_before_s = {key: at for key, at in self._not_before_s.items() if key in self._repository.queue.jobs}

    async def _advance(self, job: Job) -> None:
        if job.id in self._unmade:
            self._unmade.remove(job.id)
            await self._make_run(job)
        else:
            await self._follower.follow(job)

    async def candidates(self, job: Job) -> tuple[Candidate, ...]:
        """What speaks for and against each vehicle now. Raises NotFoundError, PlanInvalid, StorageError."""
        plan = await self._plans.plan(job.plan_id)
        return await self._assessment.candidates(plan, job.selector, await self._availability.all(), job.wind or CALM)

    def _may_be_tried(self, job: Job) -> bool:
        return self._not_before_s.get(job.id, 0.0) <= self._clock.monotonic()

    async def _give_out(self, due: Sequence[Job], breath: TimeSlice) -> None:
        """Try the jobs in order; of equal ones, none after one that no vehicle could take.

        The snapshot of the vehicles only selects the jobs worth trying: the chosen vehicle is checked again.
        """
        refused = set[tuple[str, Wind | None, VehicleSelector]]()
        free, seen_s = await self._free(), self._clock.monotonic()
        for job in due:
            await breath.take()
            alike = (job.plan_id, job.wind, job.selector)
            if alike in refused or not any(job.selector.allows(vehicle_id) for vehicle_id in free):
                continue
            await self._logging_errors(self._assign(job), job)
            if not self._may_be_tried(job):
                refused.add(alike)
            if self._repository.queue.jobs.get(job.id) is not job or self._clock.monotonic() - seen_s >= SEEN_FOR_S:
                free, seen_s = await self._free(), self._clock.monotonic()

    async def _free(self) -> frozenset[str]:
        """The vehicles that could begin now."""
        return frozenset(vehicle.vehicle_id for vehicle in await self._availability.all() if not why_not_ready(vehicle))

    async def _judge_ready(self, breath: TimeSlice) -> bool:
        """Stop the queues of vehicles whose newest run ended badly. Whether that is known of all that are ready."""
        try:
            for vehicle in await self._availability.all():
                await breath.take()
                if not why_not_ready(vehicle):
                    await self._availability.judge(vehicle.vehicle_id, self._clock.now())
        except WaydropError as error:
            log.warning("no job is started: earlier runs cannot be read", error=error.detail)
            return False
        return True

    async def _expire(self, job: Job) -> None:
        try:
            candidates = await self.candidates(job)
        except WaydropError:
            candidates = ()
        await self._repository.change(job.id, lambda current: self._expired(current, candidates))

    def _expired(self, job: Job, candidates: tuple[Candidate, ...]) -> Job:
        if job.state is not JobState.QUEUED:
            return job
        return job.moved_to(JobState.EXPIRED, now=self._clock.now(), reason=EXPIRED, candidates=candidates)

    async def _assign(self, job: Job) -> None:
        candidates = await self.candidates(job)
        chosen = chosen_of(candidates)
        if chosen is None:
            self._not_before_s[job.id] = self._clock.monotonic() + self._settings.retry_after_s
            return
        # a run may have ended while rules were read
        await self._availability.judge(chosen.vehicle_id, self._clock.now())
        if why_not_ready(self._availability.one(chosen.vehicle_id)):
            return
        run_id = new_run_id()  # stored before the run is made: a restart finds it, or that it is not
        given = await self._repository.change(job.id, lambda current: self._given(current, chosen, run_id, candidates))
        if given.run_id != run_id:
            return  # cancelled, or moved into the future, while the rules were looked at
        await self._make_run(given)

    async def _make_run(self, job: Job) -> None:
        vehicle_id, wind = job.vehicle_id or "", job.wind or CALM
        try:
            await self._runs.create(
                job.plan_id, vehicle_id, start=False, actor=job.requested_by, wind=wind, run_id=job.run_id
            )
        except WaydropError as error:
            self._not_before_s[job.id] = self._clock.monotonic() + self._settings.retry_after_s
            reason = Reason.of(
                ReasonCode.JOB_VEHICLE_FAILED, vehicle_id=vehicle_id, error=error.code, detail=error.detail
            )
            await self._repository.change(job.id, lambda current: current.requeued(reason, now=self._clock.now()))

    def _given(self, job: Job, chosen: Candidate, run_id: str, candidates: tuple[Candidate, ...]) -> Job:
        if not job.is_due(self._clock.now()):
            return job
        return job.assigned(chosen.vehicle_id, run_id, candidates, now=self._clock.now())

    async def _logging_errors(self, work: Awaitable[None], job: Job) -> None:
        try:
            await work
        except NotFoundError:  # it ended, or its vehicle has not connected yet: the next poll decides
            return
        except WaydropError as error:
            log.warning("job not advanced", job=job.id, error=error.detail)
