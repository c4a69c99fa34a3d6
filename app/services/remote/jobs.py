"""Jobs of all sites. One that a single site may fly waits at its gateway, others wait in the cluster's store."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final, Protocol

from app.domain.cluster.envelope import site_of
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.errors import JobWrongStateError, NotFoundError, WaydropError
from app.domain.jobs.assignment import chosen_of, hopeless
from app.domain.jobs.job import Job, JobState
from app.domain.jobs.queue import JobQueue
from app.domain.ports.stores import ALL_JOBS, AnswerTo, JobFilter, JobStore, StoredPlan
from app.services.clock import Clock
from app.services.jobs.changes import refuse_past
from app.services.jobs.repository import MOST_OPEN
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobUpdate, VehicleQueueView
from app.services.plans import KnownPlans
from app.services.remote.calls import Caller
from app.services.remote.candidates import SiteCandidates, at_site
from app.services.remote.fleet import Gateways, RemoteFleet
from app.services.remote.shared_jobs import SharedJobStore, request_of

SHARED_JOBS: Final = "waydrop.jobs"
"""Calls to the node that gives shared jobs to gateways."""


class SitedJobs(JobStore, Protocol):
    """The jobs of all sites."""

    async def site_of(self, job_id: str) -> str | None:
        """The site whose gateway has a job. Raises StorageError."""


class RemoteJobs:
    """JobsApi of an API node."""

    def __init__(
        self,
        store: SitedJobs,
        shared: SharedJobStore,
        plans: KnownPlans,
        fleet: RemoteFleet,
        gateways: Gateways,
        caller: Caller,
        clock: Clock,
    ) -> None:
        self._store = store
        self._clock = clock
        self._shared = shared
        self._plans = plans
        self._fleet = fleet
        self._gateways = gateways
        self._caller = caller
        self._candidates = SiteCandidates(fleet, gateways)

    async def create(self, request: JobRequest, actor: str, answer: AnswerTo[Job] | None = None) -> Job:
        """See JobsApi. Who stores the job gets no answer: the claim of its key is stored."""
        sites = self._candidates.sites_for(request)
        if len(sites) > 1:
            made = await self._call_shared("create_job", request=request, actor=actor)
            with suppress(WaydropError):  # it is stored
                made = await self._with_candidates(made)
            return made
        plan, here = await self._stored(request), at_site(sites[0], request)
        job: Job = await self._gateways.call(sites[0], "create_job", Job, order=here, plan=plan, actor=actor)
        return job

    async def check(self, request: JobRequest) -> AssignmentView:
        """See JobsApi. Sites that do not answer have no candidates."""
        refuse_past(request, self._clock.now())
        candidates = await self._candidates.assessed(request, await self._stored(request))
        chosen = chosen_of(candidates)
        vehicle_id = None if chosen is None else chosen.vehicle_id
        return AssignmentView(vehicle_id=vehicle_id, candidates=candidates, warning=hopeless(candidates))

    async def get(self, job_id: str) -> Job:
        """See JobsApi; as its gateway has it, or as it is stored if that does not answer."""
        job = await self._known(job_id)
        with suppress(GatewayUnreachableError, NoReplyError, BusDownError, NotFoundError):
            if _waits_here(job):
                return await self._with_candidates(job) if job.state is JobState.QUEUED else job
            job = await self._gateways.call(await self._site_of(job), "job", Job, job_id=job_id)
        return job

    async def list_jobs(self, limit: int, wanted: JobFilter = ALL_JOBS) -> Sequence[Job]:
        if wanted.older_than is not None:
            await self._known(wanted.older_than)
        return await self._store.list_jobs(wanted, limit=limit)

    async def cancel(self, job_id: str, actor: str) -> Job:
        return await self._call("cancel_job", job_id, actor=actor)

    async def move(self, job_id: str, move: JobUpdate, actor: str) -> Job:
        return await self._call("update_job", job_id, move=move, actor=actor)

    async def clear_claim(self, job_id: str, actor: str) -> Job:
        job = await self._known(job_id)
        if job.claim is None:
            raise JobWrongStateError(
                f"no gateway has a claim of job {job_id}", hint="read the job again", state=job.state.value
            )
        return await self._call_shared("clear_claim", job_id=job_id, actor=actor)

    async def queues(self) -> JobQueuesView:
        """See JobsApi. Sites that do not answer are left out."""
        asked: dict[str, dict[str, Any]] = {site: {} for site in self._fleet.sites()}
        views = (await self._candidates.all_that_answer(asked, "job_queues", JobQueuesView)).values()
        shared = JobQueue().with_jobs(await self._shared.list_jobs(JobFilter(open_only=True), limit=MOST_OPEN))
        waiting = sorted((*shared.waiting, *(job for view in views for job in view.waiting)), key=lambda job: job.place)
        return JobQueuesView(
            dispatching=all(view.dispatching for view in views),
            capacity=shared.capacity + sum(view.capacity for view in views),
            waiting=tuple(waiting),
            vehicles=tuple(self._with_shared(one, shared, waiting) for view in views for one in view.vehicles),
        )

    async def stop(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        return await self._queue("stop_queue", vehicle_id, actor)

    async def resume(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        return await self._queue("resume_queue", vehicle_id, actor)

    def _with_shared(self, view: VehicleQueueView, shared: JobQueue, waiting: Sequence[Job]) -> VehicleQueueView:
        vehicle_id = view.queue.vehicle_id
        with suppress(NotFoundError):  # it has not been reported yet
            vehicle_type = self._fleet.view(vehicle_id).vehicle_type
            ids = {*view.waiting, *shared.waiting_for(vehicle_id, vehicle_type)}
            return view.model_copy(update={"waiting": tuple(job.id for job in waiting if job.id in ids)})
        return view

    async def _with_candidates(self, job: Job) -> Job:
        candidates = await self._candidates.assessed(request_of(job), await self._plans.stored(job.plan_id))
        return job.model_copy(update={"candidates": candidates, "warning": hopeless(candidates)})

    async def _stored(self, request: JobRequest) -> StoredPlan | None:
        return await self._plans.stored(request.plan) if isinstance(request.plan, str) else None

    async def _known(self, job_id: str) -> Job:
        job = await self._store.get(job_id)
        if job is None:
            raise NotFoundError(f"no job {job_id!r}", hint="list the jobs to see their IDs")
        return job

    async def _site_of(self, job: Job) -> str:
        return job.claim.site if job.claim is not None else await self._store.site_of(job.id) or ""

    async def _call(self, method: str, job_id: str, **arguments: object) -> Job:
        job = await self._known(job_id)
        if _waits_here(job):
            return await self._call_shared(method, job_id=job_id, **arguments)
        if job.claim is not None and not job.claim.taken:
            raise JobWrongStateError(
                f"the gateway of {job.claim.site} has not answered yet whether it has job {job_id}",
                hint="try again; if that gateway is switched off, clear its claim",
                state=job.state.value,
            )
        called: Job = await self._gateways.call(await self._site_of(job), method, Job, job_id=job_id, **arguments)
        return called

    async def _call_shared(self, method: str, **arguments: object) -> Job:
        return await self._caller.call(SHARED_JOBS, SHARED_JOBS, method, Job, **arguments)

    async def _queue(self, method: str, vehicle_id: str, actor: str) -> VehicleQueueView:
        self._fleet.require_site(vehicle_id)
        view: VehicleQueueView = await self._gateways.call(
            site_of(vehicle_id), method, VehicleQueueView, vehicle_id=vehicle_id, actor=actor
        )
        return view


def _waits_here(job: Job) -> bool:
    """Whether the cluster has it, and no gateway."""
    return job.fence > 0 and (job.claim is None or job.state is JobState.RETURNED)
