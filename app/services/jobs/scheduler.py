"""The scheduler: polls the queue, and assigns each due job to a suitable vehicle."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Sequence
from dataclasses import dataclass, field
from typing import Final

import structlog

from app.domain.errors import NotFoundError, WaydropError
from app.domain.jobs.assignment import chosen_of, why_not_ready
from app.domain.jobs.job import Candidate, Job, JobState, VehicleSelector
from app.domain.prediction import CALM, Wind
from app.domain.reasons import Reason, ReasonCode
from app.services.background import end_tasks
from app.services.clock import Clock
from app.services.jobs.assessment import Assessment
from app.services.jobs.availability import VehicleAvailability
from app.services.jobs.deadlines import Deadlines
from app.services.jobs.follower import EXPIRED, JobFollower
from app.services.jobs.repository import JobRepository
from app.services.jobs.time_slice import TimeSlice
from app.services.jobs.views import JobSettings
from app.services.plans import Plans
from app.services.runs import Runs
from app.services.runs.recorder import new_run_id

log = structlog.get_logger(__name__)
SEEN_FOR_S: Final = 0.5
"""How long a pass uses its snapshot of the vehicles."""
FACTS_S: Final = 0.1
"""So long a pass waits for the facts of a vehicle. Those that the link has come at once; others wake the scheduler."""
FOLLOWED_S: Final = 0.1
"""So long a pass waits for one job that is followed. A start may wait for its vehicle, and the others do not."""

_Alike = tuple[str, Wind | None, VehicleSelector]
"""What jobs have in common that the same vehicles can take."""


@dataclass(frozen=True, slots=True)
class _Tried:
    """What a pass has tried so far. `in_vain`: jobs that no vehicle could take yet, and those like them. `kept`:
    vehicles for a job that waits a moment for the facts of another one that may suit it better.
    """

    in_vain: set[_Alike] = field(default_factory=set)
    kept: set[str] = field(default_factory=set)


def _alike(job: Job) -> _Alike:
    return job.plan_id, job.wind, job.selector


class JobScheduler:
    """One task. `poll` is one pass: follow assigned jobs, expire late ones, assign due ones."""

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
        self._deadlines = Deadlines(clock, settings.late_for_s)
        self._follower = JobFollower(repository, runs, availability, clock, self._deadlines)
        self._woken = asyncio.Event()
        self._not_before_s: dict[str, float] = {}
        self._unmade: set[str] = set()
        self._following: dict[str, asyncio.Task[None]] = {}
        assessment.on_late_answer(self.wake)

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
        try:
            while True:
                self._woken.clear()
                await self.poll()
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(self._settings.poll_every_s):
                        await self._woken.wait()
        finally:
            await end_tasks(*self._following.values())

    async def poll(self) -> None:
        """One pass. What fails is logged, and tried again at a later one."""
        time_slice = TimeSlice()
        self._end_followed()
        for job in self._repository.queue.active:
            await self._follow(job)
            self._end_followed()
            await time_slice.take()
        now = self._clock.now()
        for job in self._repository.queue.waiting:
            if self._deadlines.has_passed(job):
                await self._logging_errors(self._expire(job), job)
        await time_slice.take()
        due = [job for job in self._repository.queue.due(now) if self._may_be_tried(job)]
        if due and await self._judge_ready(time_slice):
            await self._assign_due(due, time_slice)
        self._not_before_s = {key: at for key, at in self._not_before_s.items() if key in self._repository.queue.jobs}
        self._deadlines.keep(self._repository.queue.jobs)

    async def _follow(self, job: Job) -> None:
        """Follow a job in a task of its own, unless it is being followed since an earlier pass."""
        if job.id not in self._following:
            work = self._logging_errors(self._advance(job), job)
            task = self._following[job.id] = asyncio.create_task(work, name=f"follow {job.id}")
            await asyncio.wait({task}, timeout=FOLLOWED_S)

    def _end_followed(self) -> None:
        """Forget the tasks that have ended. A defect in one ends the scheduler."""
        for job_id in [key for key, task in self._following.items() if task.done()]:
            self._following.pop(job_id).result()

    async def _advance(self, job: Job) -> None:
        if job.id in self._unmade:
            self._unmade.remove(job.id)
            await self._make_run(job)
        else:
            await self._follower.follow(job)

    async def candidates(self, job: Job, facts_s: float | None = None) -> tuple[Candidate, ...]:
        """What speaks for and against each vehicle now; `facts_s` as Assessment.candidates. Raises NotFoundError,
        PlanInvalid, StorageError.
        """
        plan, vehicles = await self._plans.plan(job.plan_id), await self._availability.all()
        return await self._assessment.candidates(plan, job.selector, vehicles, job.wind or CALM, facts_s)

    def _may_be_tried(self, job: Job) -> bool:
        return self._not_before_s.get(job.id, 0.0) <= self._clock.monotonic()

    async def _assign_due(self, due: Sequence[Job], time_slice: TimeSlice) -> None:
        """Try the jobs in order; of equal ones, none after one that no vehicle could take.

        The snapshot of the vehicles only selects the jobs worth trying: the chosen vehicle is checked again.
        """
        tried = _Tried()
        free, seen_s = await self._free(), self._clock.monotonic()
        for job in due:
            await time_slice.take()
            if _alike(job) in tried.in_vain or not any(job.selector.allows(one) for one in free - tried.kept):
                continue
            await self._logging_errors(self._assign(job, tried), job)
            if not self._may_be_tried(job):
                tried.in_vain.add(_alike(job))
            if self._repository.queue.jobs.get(job.id) is not job or self._clock.monotonic() - seen_s >= SEEN_FOR_S:
                free, seen_s = await self._free(), self._clock.monotonic()

    async def _free(self) -> frozenset[str]:
        """The vehicles that could begin now."""
        return frozenset(vehicle.vehicle_id for vehicle in await self._availability.all() if not why_not_ready(vehicle))

    async def _judge_ready(self, time_slice: TimeSlice) -> bool:
        """Stop the queues of vehicles whose newest run ended badly. Whether that is known of all that are ready."""
        try:
            for vehicle in await self._availability.all():
                await time_slice.take()
                if not why_not_ready(vehicle):
                    await self._availability.judge(vehicle.vehicle_id, self._clock.now())
        except WaydropError as error:
            log.warning("no job is started: earlier runs cannot be read", error=error.detail)
            return False
        return True

    async def _expire(self, job: Job) -> None:
        try:
            candidates = await self.candidates(job, FACTS_S)
        except WaydropError:
            candidates = ()
        await self._repository.change(job.id, lambda current: self._expired(current, candidates))

    def _expired(self, job: Job, candidates: tuple[Candidate, ...]) -> Job:
        if job.state is not JobState.QUEUED:
            return job
        return job.moved_to(JobState.EXPIRED, now=self._clock.now(), reason=EXPIRED, candidates=candidates)

    async def _assign(self, job: Job, tried: _Tried) -> None:
        candidates = await self.candidates(job, FACTS_S)
        if any(self._assessment.is_awaited(one) for one in candidates):
            tried.in_vain.add(_alike(job))
            tried.kept.update(one.vehicle_id for one in candidates if one.can)
            return
        chosen = chosen_of(candidates)
        if chosen is None:
            self._not_before_s[job.id] = self._clock.monotonic() + self._settings.retry_after_s
            return
        if chosen.vehicle_id in tried.kept:
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
