"""Jobs of all sites. A job belongs to one site: that of the vehicle it names, or of the one that suits it best now."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Protocol, TypeVar

from app.domain.cluster.envelope import site_of
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.errors import NotFoundError
from app.domain.jobs.assignment import best_of, chosen_of, hopeless
from app.domain.jobs.job import Candidate, Job
from app.domain.ports.stores import ALL_JOBS, JobFilter, JobStore, StoredPlan
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobUpdate, VehicleQueueView
from app.services.plans import KnownPlans
from app.services.remote.fleet import Gateways, RemoteFleet

T = TypeVar("T")


class SitedJobs(JobStore, Protocol):
    """The jobs of all sites."""

    async def site_of(self, job_id: str) -> str | None:
        """The site that has a job. Raises StorageError."""


class RemoteJobs:
    """JobsApi of an API node."""

    def __init__(self, store: SitedJobs, plans: KnownPlans, fleet: RemoteFleet, gateways: Gateways) -> None:
        self._store = store
        self._plans = plans
        self._fleet = fleet
        self._gateways = gateways

    async def create(self, order: JobRequest, actor: str) -> Job:
        """See JobsApi."""
        plan = await self._stored(order)
        sites = self._sites_for(order)
        site = sites[0] if len(sites) == 1 else await self._best_site(sites, order, plan)
        job: Job = await self._gateways.call(site, "create_job", Job, order=_at(site, order), plan=plan, actor=actor)
        return job

    async def check(self, order: JobRequest) -> AssignmentView:
        """See JobsApi. Sites that do not answer have no candidates."""
        plan = await self._stored(order)
        candidates = _one_chosen(await self._assessed(self._sites_for(order), order, plan))
        chosen = chosen_of(candidates)
        vehicle_id = None if chosen is None else chosen.vehicle_id
        return AssignmentView(vehicle_id=vehicle_id, candidates=candidates, warning=hopeless(candidates))

    async def get(self, job_id: str) -> Job:
        """See JobsApi; as its site has it, or as it is stored if that does not answer."""
        job = await self._store.get(job_id)
        if job is None:
            raise _no_job(job_id)
        with suppress(GatewayUnreachableError, NoReplyError, BusDownError):
            job = await self._call("job", job_id)
        return job

    async def list_jobs(self, limit: int, wanted: JobFilter = ALL_JOBS) -> Sequence[Job]:
        """See JobsApi."""
        if wanted.older_than is not None and await self._store.get(wanted.older_than) is None:
            raise _no_job(wanted.older_than)
        return await self._store.list_jobs(wanted, limit=limit)

    async def cancel(self, job_id: str, actor: str) -> Job:
        """See JobsApi."""
        return await self._call("cancel_job", job_id, actor=actor)

    async def move(self, job_id: str, move: JobUpdate, actor: str) -> Job:
        """See JobsApi."""
        return await self._call("update_job", job_id, move=move, actor=actor)

    async def queues(self) -> JobQueuesView:
        """See JobsApi. Sites that do not answer are left out."""
        views = await self._all_that_answer({site: {} for site in self._fleet.sites()}, "job_queues", JobQueuesView)
        return JobQueuesView(
            dispatching=all(view.dispatching for view in views.values()),
            capacity=sum(view.capacity for view in views.values()),
            waiting=tuple(sorted((job for view in views.values() for job in view.waiting), key=lambda job: job.place)),
            vehicles=tuple(vehicle for view in views.values() for vehicle in view.vehicles),
        )

    async def stop(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """See JobsApi."""
        return await self._queue("stop_queue", vehicle_id, actor)

    async def resume(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """See JobsApi."""
        return await self._queue("resume_queue", vehicle_id, actor)

    async def _stored(self, order: JobRequest) -> StoredPlan | None:
        return await self._plans.stored(order.plan) if isinstance(order.plan, str) else None

    def _sites_for(self, order: JobRequest) -> Sequence[str]:
        named = order.selector().named
        for vehicle_id in named:
            self._fleet.view(vehicle_id)
        sites = sorted({site_of(vehicle_id) for vehicle_id in named}) if named else self._fleet.sites()
        if not sites:
            raise GatewayUnreachableError("no gateway has reported yet", hint="see that gateways run and reach NATS")
        return sites

    async def _best_site(self, sites: Sequence[str], order: JobRequest, plan: StoredPlan | None) -> str:
        views = await self._assessed(sites, order, plan)
        if not views:
            raise GatewayUnreachableError("no gateway answers", hint="see that gateways run and reach NATS")
        chosen = chosen_of(_one_chosen(views))
        if chosen is not None:
            return site_of(chosen.vehicle_id)
        return next((site for site, view in views.items() if not view.warning), next(iter(views)))

    async def _assessed(
        self, sites: Sequence[str], order: JobRequest, plan: StoredPlan | None
    ) -> Mapping[str, AssignmentView]:
        asked = {site: {"order": _at(site, order), "plan": plan} for site in sites}
        return await self._all_that_answer(asked, "check_job", AssignmentView)

    async def _all_that_answer(
        self, asked: Mapping[str, Mapping[str, Any]], method: str, returns: type[T]
    ) -> Mapping[str, T]:
        calls = (self._gateways.call(site, method, returns, **arguments) for site, arguments in asked.items())
        found: dict[str, T] = {}
        for site, answer in zip(asked, await asyncio.gather(*calls, return_exceptions=True), strict=True):
            if isinstance(answer, GatewayUnreachableError | NoReplyError):
                continue
            if isinstance(answer, BaseException):
                raise answer
            found[site] = answer
        return found

    async def _call(self, method: str, job_id: str, **arguments: object) -> Job:
        site = await self._store.site_of(job_id)
        if site is None:
            raise _no_job(job_id)
        job: Job = await self._gateways.call(site, method, Job, job_id=job_id, **arguments)
        return job

    async def _queue(self, method: str, vehicle_id: str, actor: str) -> VehicleQueueView:
        self._fleet.view(vehicle_id)
        view: VehicleQueueView = await self._gateways.call(
            site_of(vehicle_id), method, VehicleQueueView, vehicle_id=vehicle_id, actor=actor
        )
        return view


def _at(site: str, order: JobRequest) -> JobRequest:
    """The order as one site gets it: without vehicles of others."""
    here = tuple(one for one in order.allowed_vehicles if site_of(one) == site)
    return order.model_copy(update={"allowed_vehicles": here})


def _one_chosen(views: Mapping[str, AssignmentView]) -> tuple[Candidate, ...]:
    """All candidates; of those that their sites chose, the best one stays chosen."""
    candidates = [one for view in views.values() for one in view.candidates]
    able = [one for one in candidates if one.chosen]
    chosen = best_of(able).vehicle_id if able else None
    return tuple(one.model_copy(update={"chosen": one.vehicle_id == chosen}) for one in candidates)


def _no_job(job_id: str) -> NotFoundError:
    return NotFoundError(f"no job {job_id!r}", hint="list the jobs to see their IDs")
