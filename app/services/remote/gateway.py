"""What API nodes may ask of a gateway, with arguments and answers that are JSON."""

from __future__ import annotations

from pydantic import BaseModel

from app.domain.errors import ConflictError, JobNotTakenError
from app.domain.jobs.job import Job
from app.domain.ports.stores import StoredPlan
from app.domain.prediction import Wind
from app.domain.run.run import Run
from app.services.jobs.views import AssignmentView, JobRequest
from app.services.remote.calls import CallFunctions
from app.services.remote.fleet import WIRE_FIELDS, WireProfile
from app.services.remote.gateway_services import GatewayServices


class GatewayCalls:
    """Each does what the service does. Roles were checked by the API node, which signs each call with the name of who
    asked for it.
    """

    def __init__(self, services: GatewayServices, gateway: str) -> None:
        self._services = services
        self._gateway = gateway

    def functions(self) -> CallFunctions:
        """By the names of the calls: the service's own where it takes and returns JSON."""
        services = self._services
        return {
            "facts": self.facts,
            "end_quarantine": services.fleet.end_quarantine,
            "hold": services.commands.hold,
            "return_vehicle": services.commands.return_to_launch,
            "land_vehicle": services.commands.land,
            "set_up_signing": services.links.set_up_signing,
            "create_run": self.create_run,
            "start_run": self.start_run,
            "pause_run": services.runs.pause,
            "resume_run": services.runs.resume,
            "return_run": services.runs.return_to_launch,
            "divert_run": services.runs.divert,
            "land_run": services.runs.land,
            "abort_run": services.runs.abort,
            "answer_consent": services.runs.answer_consent,
            "change_run": self.change_run,
            "insert_items": services.rerouting.insert,
            "continue_run": services.rerouting.continue_over,
            "create_job": self.create_job,
            "take_job": self.take_job,
            "claim_of": self.claim_of,
            "check_job": self.check_job,
            "job": services.jobs.get,
            "cancel_job": services.jobs.cancel,
            "update_job": services.jobs.move,
            "job_queues": services.jobs.queues,
            "stop_queue": services.jobs.stop,
            "resume_queue": services.jobs.resume,
        }

    async def facts(self, vehicle_id: str) -> BaseModel:
        """See FleetApi.facts; a WireProfile."""
        profile = await self._services.fleet.facts(vehicle_id)
        return WireProfile(**{name: getattr(profile, name) for name in WIRE_FIELDS})

    async def create_run(self, plan: StoredPlan, vehicle_id: str, start: bool, actor: str, wind: Wind) -> Run:
        """See Runs. The plan is stored here too, if it is not yet."""
        await self._services.plans.adopt(plan)
        return await self._services.runs.create(plan.id, vehicle_id, start=start, actor=actor, wind=wind)

    async def start_run(self, run_id: str) -> Run:
        return await self._services.runs.start(run_id)

    async def change_run(self, run_id: str, plan: StoredPlan | None, continue_at: str | None, actor: str) -> Run:
        if plan is not None:
            await self._services.plans.adopt(plan)
        return await self._services.rerouting.change(run_id, None if plan is None else plan.id, continue_at, actor)

    async def create_job(self, order: JobRequest, plan: StoredPlan | None, actor: str) -> Job:
        if plan is not None:
            await self._services.plans.adopt(plan)
        return await self._services.jobs.create(order, actor)

    async def take_job(self, job: Job, plan: StoredPlan) -> Job:
        if job.claim is None or job.claim.gateway != self._gateway:
            raise JobNotTakenError(f"job {job.id} is given to another gateway", hint="read the job again")
        await self._services.plans.adopt(plan)
        return await self._services.jobs.take(job)

    async def claim_of(self, job: Job) -> Job:
        """See Jobs.claim_of. Raises ConflictError: another gateway of this site was to take it."""
        if job.claim is None or job.claim.gateway != self._gateway:
            raise ConflictError(f"job {job.id} was given to another gateway of this site", hint="start that gateway")
        return await self._services.jobs.claim_of(job)

    async def check_job(
        self, order: JobRequest, plan: StoredPlan | None, facts_s: float | None = None
    ) -> AssignmentView:
        """See Jobs. Nothing is stored: the order gets the plan's document."""
        if plan is not None:
            order = order.model_copy(update={"plan": plan.document})
        return await self._services.jobs.check(order, facts_s)
