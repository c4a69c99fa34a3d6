"""Jobs that several sites may fly: they wait in the cluster's store, and one gateway after the other may get each."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Sequence
from contextlib import suppress
from typing import Final, Protocol

import structlog

from app.domain.cluster.envelope import site_of
from app.domain.cluster.errors import GatewayUnreachableError
from app.domain.errors import JobNotTakenError, JobWrongStateError, NotFoundError, WaydropError
from app.domain.jobs.assignment import chosen_of
from app.domain.jobs.job import TAKEN_WITHIN_S, Candidate, Job, JobClaim, JobState, VehicleSelector
from app.domain.ports.journal import EventJournal
from app.domain.ports.stores import JobStore, StoredPlan
from app.domain.prediction import Wind, WindGiven
from app.domain.reasons import Reason, ReasonCode
from app.services.clock import Clock
from app.services.jobs.changes import JobChanges
from app.services.jobs.deadlines import Deadlines
from app.services.jobs.follower import EXPIRED
from app.services.jobs.repository import JobRepository
from app.services.jobs.views import JobRequest, JobSettings, JobUpdate
from app.services.plans import Plans
from app.services.remote.calls import CallFunctions, CallRefusedError
from app.services.remote.candidates import SiteCandidates
from app.services.remote.fleet import Gateways, RemoteFleet
from app.services.runs.recorder import new_run_id

log = structlog.get_logger(__name__)

ANSWERED_S: Final = 2.0
"""Of one call to a gateway: one that is cut off does not hold up the others. What it did is asked again."""
MOST_CANDIDATES: Final = 50
"""That an expired job keeps, of all sites."""
PASS_S: Final = 5.0
"""After so long of giving jobs out, those that were given are asked for again."""
AVOIDED_S: Final = 10.0
CLEARED_AFTER_S: Final = TAKEN_WITHIN_S + 5.0
"""So old a claim must be before a person clears it: then its order is not taken any more, also by a gateway whose clock
is a little behind."""
NOT_BEGUN: Final = (GatewayUnreachableError, JobNotTakenError, NotFoundError, CallRefusedError)
"""The gateway has stored nothing, and never will: nobody answers, it refuses, or it does not know the call."""


class SharedJobStore(JobStore, Protocol):
    """The jobs of the cluster itself: those with a fencing number. Lists leave out what a gateway has taken."""

    async def returned(self) -> Sequence[Job]:
        """Those of the cluster's claims that a gateway gave back. Raises StorageError."""


class SharedJobs:
    """The queue of these jobs, with the changes of JobChanges. It runs on the node that writes the cluster's store.

    A gateway is named in the job before it hears of it (its claim), and takes it with the fencing number that this
    change gave the job. A claim ends when the gateway has certainly not begun: nobody answers there, it refuses, or it
    has stored that it will never take it. Until then no other gateway gets the job, unless a person clears the claim.
    """

    def __init__(
        self,
        store: SharedJobStore,
        plans: Plans,
        journal: EventJournal,
        clock: Clock,
        fleet: RemoteFleet,
        gateways: Gateways,
        settings: JobSettings | None = None,
    ) -> None:
        self._settings = settings or JobSettings()
        self._store = store
        self._plans = plans
        self._clock = clock
        self._fleet = fleet
        self._gateways = gateways
        self._candidates = SiteCandidates(fleet, gateways)
        self._repository = JobRepository(store, journal, clock, self._settings.capacity, is_fenced=True)
        self._changes = JobChanges(self._repository, store, plans, clock)
        self._deadlines = Deadlines(clock, self._settings.late_for_s)
        self._woken = asyncio.Event()
        self._not_before_s: dict[str, float] = {}
        self._avoided_until_s: dict[str, float] = {}

    async def run(self) -> None:
        """Give jobs to gateways until cancelled."""
        while True:
            self._woken.clear()
            try:
                await self.poll()
            except WaydropError as error:
                log.warning("jobs that several sites may fly cannot be read", error=error.detail)
            with suppress(TimeoutError):
                async with asyncio.timeout(self._settings.poll_every_s):
                    await self._woken.wait()

    async def poll(self) -> None:
        """One pass. What fails is logged, and tried again at a later one. Raises StorageError."""
        await self._read()
        now = self._clock.now()
        unanswered = [
            self._logging_errors(self._ask(job, job.claim), job)
            for job in self._repository.queue.active
            if job.claim is not None and self._may_be_tried(job)
        ]
        await asyncio.gather(*unanswered)
        for job in self._repository.queue.waiting:
            if self._deadlines.has_passed(job):
                await self._logging_errors(self._expire(job), job)
        refused, tried_from_s = set[tuple[str, Wind | None, VehicleSelector]](), self._clock.monotonic()
        for job in self._repository.queue.due(now):
            alike = (job.plan_id, job.wind, job.selector)
            if self._clock.monotonic() - tried_from_s > PASS_S:
                break  # what was tried waits a while, so the next pass begins after it
            if alike not in refused and self._may_be_tried(job):
                await self._logging_errors(self._give(job), job)
                if self._repository.queue.jobs.get(job.id) is job:
                    refused.add(alike)
        self._not_before_s = {key: at for key, at in self._not_before_s.items() if key in self._repository.queue.jobs}
        self._deadlines.keep(self._repository.queue.jobs)

    async def create(self, request: JobRequest, actor: str) -> Job:
        await self._read()
        job = await self._changes.create(request, actor)
        self._woken.set()
        return job

    async def cancel(self, job_id: str, actor: str) -> Job:
        await self._read()
        if job_id not in self._repository.queue.jobs and (job := await self._store.get(job_id)) is not None:
            _refuse_if_given(job)
        return await self._changes.cancel(job_id, actor, _refuse_if_given)

    async def move(self, job_id: str, move: JobUpdate, actor: str) -> Job:
        await self._read()
        return await self._changes.move(job_id, move, actor)

    async def clear_claim(self, job_id: str, actor: str) -> Job:
        """Take a job from a gateway that does not answer.

        Raises:
            NotFoundError, StorageError. JobWrongStateError: its run was started, its gateway answers that it has it, or
            its order may still arrive there.
        """
        await self._read()
        job = await self._store.get(job_id)
        if job is None:
            raise NotFoundError(f"no job {job_id!r}", hint="list the jobs to see their IDs")
        claim, now = job.claim, self._clock.now()
        reason = Reason.of(ReasonCode.JOB_CLAIM_CLEARED, site="" if claim is None else claim.site, actor=actor)
        job.taken_back(reason, now=now)
        _refuse_if_on_its_way(job, now)
        held = await self._answer_of_its_gateway(job)
        if held is not None and held.state is not JobState.RETURNED:
            raise JobWrongStateError(
                f"the gateway of {held.vehicle_id} answers that it has job {job_id}",
                hint="cancel the job; that ends its run on the ground",
                state=held.state.value,
            )
        cleared = await self._repository.reopen(job, lambda asked: asked.taken_back(reason, now=now), actor)
        self._woken.set()
        return cleared

    async def _answer_of_its_gateway(self, job: Job) -> Job | None:
        try:
            return await self._claim_of(job)
        except WaydropError as error:  # it is away, it cannot say, or another gateway has the site: a person decides
            log.warning("a claim is cleared without its gateway", job=job.id, error=error.detail)
            return None

    def _may_be_tried(self, job: Job) -> bool:
        return self._not_before_s.get(job.id, 0.0) <= self._clock.monotonic()

    def _try_later(self, job: Job) -> None:
        self._not_before_s[job.id] = self._clock.monotonic() + self._settings.retry_after_s

    async def _read(self) -> None:
        """The jobs as gateways and other nodes have left them. Raises StorageError."""
        await self._repository.load()
        for job in await self._store.returned():
            self._try_later(job)  # the gateway that could not fly it would be chosen again
            await self._logging_errors(self._requeue(job), job)

    async def _requeue(self, job: Job) -> None:
        now = self._clock.now()
        await self._repository.reopen(job, lambda returned: returned.taken_back(returned.reason, now=now))

    async def _expire(self, job: Job) -> None:
        candidates: tuple[Candidate, ...] = ()
        with suppress(WaydropError):
            candidates = await self._candidates.assessed_soon(request_of(job), await self._plans.stored(job.plan_id))
        now, kept = self._clock.now(), candidates[:MOST_CANDIDATES]
        await self._repository.change(
            job.id, lambda late: late.moved_to(JobState.EXPIRED, now=now, reason=EXPIRED, candidates=kept)
        )

    async def _give(self, job: Job) -> None:
        plan = await self._plans.stored(job.plan_id)
        self._try_later(job)
        candidates = await self._candidates.assessed_soon(request_of(job), plan, self._avoided())
        chosen = chosen_of(candidates)
        gateway = None if chosen is None else self._fleet.gateway_of(site_of(chosen.vehicle_id))
        if chosen is None or gateway is None:
            return
        claim, run_id = JobClaim(site=site_of(chosen.vehicle_id), gateway=gateway), new_run_id()
        here = tuple(one for one in candidates if site_of(one.vehicle_id) == claim.site)
        given = await self._repository.change(job.id, lambda now: self._given(now, claim, run_id, here))
        if given.run_id == run_id:  # else it was moved into the future, or cancelled, meanwhile
            await self._offer(given, claim, plan)

    def _given(self, job: Job, claim: JobClaim, run_id: str, candidates: tuple[Candidate, ...]) -> Job:
        now = self._clock.now()
        return job.given(claim, run_id, candidates, now=now) if job.is_due(now) else job

    async def _offer(self, given: Job, claim: JobClaim, plan: StoredPlan) -> None:
        try:
            await self._gateways.call(claim.site, "take_job", Job, ANSWERED_S, job=given, plan=plan)
        except NOT_BEGUN as error:
            await self._take_back(given, claim, error)
        except WaydropError:
            self._avoid(claim)
            raise

    async def _ask(self, job: Job, claim: JobClaim) -> None:
        """What the gateway says is stored when this returns: it has relayed it."""
        self._try_later(job)
        try:
            await self._claim_of(job)
        except JobNotTakenError as error:
            await self._take_back(job, claim, error)

    async def _take_back(self, given: Job, claim: JobClaim, error: WaydropError) -> None:
        reason = Reason.of(ReasonCode.JOB_NOT_TAKEN, site=claim.site, error=error.code, detail=error.detail)
        if not isinstance(error, JobNotTakenError):
            self._avoid(claim)

        def taken_back(job: Job) -> Job:
            if job.fence != given.fence:
                raise JobWrongStateError(f"job {job.id} was changed meanwhile", state=job.state.value)
            return job.taken_back(reason, now=self._clock.now())

        await self._repository.change(given.id, taken_back)

    def _avoid(self, claim: JobClaim) -> None:
        """Its gateway cannot take jobs now, though its vehicles are ready."""
        self._avoided_until_s[claim.site] = self._clock.monotonic() + AVOIDED_S

    def _avoided(self) -> frozenset[str]:
        now_s = self._clock.monotonic()
        return frozenset(site for site, until_s in self._avoided_until_s.items() if until_s > now_s)

    async def _claim_of(self, job: Job) -> Job:
        site = "" if job.claim is None else job.claim.site
        held: Job = await self._gateways.call(site, "claim_of", Job, ANSWERED_S, job=job)
        return held

    async def _logging_errors(self, work: Awaitable[None], job: Job) -> None:
        try:
            await work
        except WaydropError as error:
            log.warning("job not advanced", job=job.id, error=error.detail)


def request_of(job: Job) -> JobRequest:
    """What was requested, for the assessment of vehicles."""
    wind = None if job.wind is None else WindGiven(north_m_s=job.wind.north_m_s, east_m_s=job.wind.east_m_s)
    return JobRequest(
        plan=job.plan_id,
        vehicle=job.selector.vehicle,
        allowed_vehicles=job.selector.allowed_vehicles,
        min_battery_percent=job.selector.min_battery_percent,
        wind=wind,
    )


def _refuse_if_on_its_way(job: Job, now: float) -> None:
    left_s = job.updated_at + CLEARED_AFTER_S - now
    if job.state is JobState.PREPARING and job.claim is not None and not job.claim.taken and left_s > 0:
        raise JobWrongStateError(
            f"the gateway of {job.claim.site} may still get job {job.id}",
            hint=f"try again in {math.ceil(left_s)} s",
            state=job.state.value,
        )


def _refuse_if_given(job: Job) -> None:
    if job.state is JobState.RETURNED:  # to a store that was restored since, so that it is not queued again by itself
        raise JobWrongStateError(
            f"the gateway of {job.vehicle_id} gave job {job.id} back",
            hint="nothing flies it; to queue it again, clear its claim",
            state=job.state.value,
        )
    if job.claim is not None:
        raise JobWrongStateError(
            f"job {job.id} was given to a gateway a moment ago", hint="try again", state=job.state.value
        )


def shared_job_calls(jobs: SharedJobs) -> CallFunctions:
    """What nodes ask of the one that gives jobs to gateways."""
    return {
        "create_job": jobs.create,
        "cancel_job": jobs.cancel,
        "update_job": jobs.move,
        "clear_claim": jobs.clear_claim,
    }
