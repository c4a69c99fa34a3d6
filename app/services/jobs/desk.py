"""The desk: looks at the queue again and again, and gives each job that is due to the vehicle that can."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Sequence
from typing import Final

import structlog

from app.domain.errors import NotFoundError, WaydropError
from app.domain.jobs.candidate import Candidate
from app.domain.jobs.choice import chosen_of
from app.domain.jobs.job import Job, JobState, Wish
from app.domain.jobs.readiness import why_not_ready
from app.domain.prediction import CALM, Wind
from app.domain.reason import ReasonCode, because
from app.services.clock import Clock
from app.services.jobs.assessment import Assessment
from app.services.jobs.book import JobBook
from app.services.jobs.breath import Breath
from app.services.jobs.following import EXPIRED, JobFollower
from app.services.jobs.settings import JobSettings
from app.services.jobs.sights import VehicleSights
from app.services.plans import Plans
from app.services.runs import Runs
from app.services.runs.new_run import new_run_id

log = structlog.get_logger(__name__)
SEEN_FOR_S: Final = 0.5
"""How long a pass goes by what it saw of the vehicles."""


class JobDesk:
    """One task. `look` is one pass: follow what has a vehicle, end what is too late, give what is due."""

    def __init__(
        self,
        book: JobBook,
        runs: Runs,
        plans: Plans,
        sights: VehicleSights,
        assessment: Assessment,
        clock: Clock,
        settings: JobSettings,
    ) -> None:
        self._book = book
        self._runs = runs
        self._plans = plans
        self._sights = sights
        self._assessment = assessment
        self._clock = clock
        self._settings = settings
        self._follower = JobFollower(book, runs, sights, clock)
        self._woken = asyncio.Event()
        self._not_before_s: dict[str, float] = {}

    def wake(self) -> None:
        """Look soon: somebody changed something."""
        self._not_before_s.clear()
        self._woken.set()

    async def run(self) -> None:
        """Look until cancelled."""
        for job in self._book.queue.active:
            await self._told(self._follower.note_unknown_start(job), job)
        while True:
            self._woken.clear()
            await self.look()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(self._settings.look_every_s):
                    await self._woken.wait()

    async def look(self) -> None:
        """One pass. What fails is logged, and tried again at a later one."""
        breath = Breath()
        for job in self._book.queue.active:
            await self._told(self._follower.follow(job), job)
            await breath.take()
        now = self._clock.now()
        for job in self._book.queue.waiting:
            if job.is_late(now):
                await self._told(self._expire(job), job)
        await breath.take()
        due = [job for job in self._book.queue.due(now) if self._may_be_tried(job)]
        if due and await self._judge_ready(breath):
            await self._give_out(due, breath)
        self._not_before_s = {key: at for key, at in self._not_before_s.items() if key in self._book.queue.jobs}

    async def candidates(self, job: Job) -> tuple[Candidate, ...]:
        """What speaks for and against each vehicle now. Raises NotFoundError, PlanInvalid, StorageError."""
        plan = await self._plans.plan(job.plan_id)
        return await self._assessment.candidates(plan, job.wish, self._sights.all(), job.wind or CALM)

    def _may_be_tried(self, job: Job) -> bool:
        return self._not_before_s.get(job.id, 0.0) <= self._clock.monotonic()

    async def _give_out(self, due: Sequence[Job], breath: Breath) -> None:
        """Try the jobs in their order; of those that are alike, none after one that no vehicle could take.

        What was seen of the vehicles only says whether a job is worth a try: the one that is chosen is looked at anew.
        """
        refused = set[tuple[str, Wind | None, Wish]]()
        free, seen_s = self._free(), self._clock.monotonic()
        for job in due:
            await breath.take()
            alike = (job.plan_id, job.wind, job.wish)
            if alike in refused or not any(job.wish.allows(vehicle_id) for vehicle_id in free):
                continue
            await self._told(self._assign(job), job)
            if not self._may_be_tried(job):
                refused.add(alike)
            if self._book.queue.jobs.get(job.id) is not job or self._clock.monotonic() - seen_s >= SEEN_FOR_S:
                free, seen_s = self._free(), self._clock.monotonic()

    def _free(self) -> frozenset[str]:
        """The vehicles that could begin now."""
        return frozenset(sight.vehicle_id for sight in self._sights.all() if not why_not_ready(sight))

    async def _judge_ready(self, breath: Breath) -> bool:
        """Stop the queues of vehicles whose newest run ended badly. Whether that is known of all that are ready."""
        try:
            await breath.take()
            for sight in self._sights.all():
                await breath.take()
                if not why_not_ready(sight):
                    await self._sights.judge(sight.vehicle_id, self._clock.now())
        except WaydropError as error:
            log.warning("no job is begun: the runs before it cannot be read", error=error.detail)
            return False
        return True

    async def _expire(self, job: Job) -> None:
        try:
            candidates = await self.candidates(job)
        except WaydropError:
            candidates = ()
        await self._book.change(job.id, lambda current: self._expired(current, candidates))

    def _expired(self, job: Job, candidates: tuple[Candidate, ...]) -> Job:
        if job.state is not JobState.QUEUED:
            return job
        return job.moved_to(JobState.EXPIRED, now=self._clock.now(), reason=EXPIRED, candidates=candidates)

    async def _assign(self, job: Job) -> None:
        candidates = await self.candidates(job)
        chosen = chosen_of(candidates)
        if chosen is None:
            self._not_before_s[job.id] = self._clock.monotonic() + self._settings.look_again_s
            return
        await self._sights.judge(chosen.vehicle_id, self._clock.now())  # a run may have ended while rules were read
        if why_not_ready(self._sights.one(chosen.vehicle_id)):
            return
        run_id = new_run_id()  # stored before the run is made: a restart finds it, or that it is not
        given = await self._book.change(job.id, lambda current: self._given(current, chosen, run_id, candidates))
        if given.run_id != run_id:
            return  # cancelled, or moved into the future, while the rules were looked at
        try:
            wind, by = given.wind or CALM, given.requested_by
            await self._runs.create(given.plan_id, chosen.vehicle_id, start=False, by=by, wind=wind, run_id=run_id)
        except WaydropError as error:
            self._not_before_s[job.id] = self._clock.monotonic() + self._settings.look_again_s
            reason = because(
                ReasonCode.JOB_VEHICLE_FAILED, vehicle_id=chosen.vehicle_id, error=error.code, detail=error.detail
            )
            await self._book.change(job.id, lambda current: current.requeued(reason, now=self._clock.now()))

    def _given(self, job: Job, chosen: Candidate, run_id: str, candidates: tuple[Candidate, ...]) -> Job:
        if not job.is_due(self._clock.now()):
            return job
        return job.assigned(chosen.vehicle_id, run_id, candidates, now=self._clock.now())

    async def _told(self, work: Awaitable[None], job: Job) -> None:
        try:
            await work
        except NotFoundError:  # it ended, or its vehicle is not seen yet: the next look finds out
            return
        except WaydropError as error:
            log.warning("job not advanced", job=job.id, error=error.detail)
