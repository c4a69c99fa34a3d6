"""What API nodes may ask of a gateway: each public method is a call, with arguments and answers that are JSON."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from app.domain.drop.consent import Answer
from app.domain.errors import ConflictError, JobNotTakenError
from app.domain.jobs.job import Job
from app.domain.ports.stores import StoredPlan
from app.domain.prediction import Wind
from app.domain.run.run import Run
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobUpdate, VehicleQueueView
from app.services.remote.fleet import WIRE_FIELDS, WireProfile
from app.services.remote.gateway_services import GatewayServices
from app.services.vehicle_links import LinkKeySetUp
from app.services.views import VehicleView


class GatewayCalls:
    """Each does what the service does. Roles were checked by the API node, which signs each call with the name of who
    asked for it.
    """

    def __init__(self, services: GatewayServices, gateway: str) -> None:
        self._services = services
        self._gateway = gateway

    async def facts(self, vehicle_id: str) -> BaseModel:
        """See FleetApi.facts; a WireProfile."""
        profile = await self._services.fleet.facts(vehicle_id)
        return WireProfile(**{name: getattr(profile, name) for name in WIRE_FIELDS})

    async def end_quarantine(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._services.fleet.end_quarantine(vehicle_id, actor)

    async def hold(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._services.commands.hold(vehicle_id, actor)

    async def return_vehicle(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._services.commands.return_to_launch(vehicle_id, actor)

    async def land_vehicle(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._services.commands.land(vehicle_id, actor)

    async def set_up_signing(self, vehicle_id: str, actor: str) -> LinkKeySetUp:
        return await self._services.links.set_up_signing(vehicle_id, actor)

    async def create_run(self, plan: StoredPlan, vehicle_id: str, start: bool, actor: str, wind: Wind) -> Run:
        """See Runs. The plan is stored here too, if it is not yet."""
        await self._services.plans.adopt(plan)
        return await self._services.runs.create(plan.id, vehicle_id, start=start, actor=actor, wind=wind)

    async def start_run(self, run_id: str) -> Run:
        return await self._services.runs.start(run_id)

    async def pause_run(self, run_id: str) -> Run:
        return await self._services.runs.pause(run_id)

    async def resume_run(self, run_id: str) -> Run:
        return await self._services.runs.resume(run_id)

    async def return_run(self, run_id: str) -> Run:
        return await self._services.runs.return_to_launch(run_id)

    async def divert_run(self, run_id: str) -> Run:
        return await self._services.runs.divert(run_id)

    async def land_run(self, run_id: str) -> Run:
        return await self._services.runs.land(run_id)

    async def abort_run(self, run_id: str) -> Run:
        return await self._services.runs.abort(run_id)

    async def answer_consent(self, run_id: str, plan_item_id: str, answer: Answer, actor: str) -> Run:
        return await self._services.runs.answer_consent(run_id, plan_item_id, answer, actor)

    async def change_run(self, run_id: str, plan: StoredPlan | None, continue_at: str | None, actor: str) -> Run:
        if plan is not None:
            await self._services.plans.adopt(plan)
        return await self._services.rerouting.change(run_id, None if plan is None else plan.id, continue_at, actor)

    async def insert_items(self, run_id: str, items: list[Any], at: str, after: bool, actor: str) -> Run:
        return await self._services.rerouting.insert(run_id, items, at=at, after=after, actor=actor)

    async def continue_run(self, run_id: str, continue_at: str | None, wind: Wind | None, actor: str) -> Run:
        return await self._services.rerouting.continue_over(run_id, continue_at, wind, actor)

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

    async def job(self, job_id: str) -> Job:
        return await self._services.jobs.get(job_id)

    async def cancel_job(self, job_id: str, actor: str) -> Job:
        return await self._services.jobs.cancel(job_id, actor)

    async def update_job(self, job_id: str, move: JobUpdate, actor: str) -> Job:
        return await self._services.jobs.move(job_id, move, actor)

    async def job_queues(self) -> JobQueuesView:
        return await self._services.jobs.queues()

    async def stop_queue(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        return await self._services.jobs.stop(vehicle_id, actor)

    async def resume_queue(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        return await self._services.jobs.resume(vehicle_id, actor)
