"""/jobs: plans that wait for a vehicle. /job-checks: which vehicle a job would get now."""

from __future__ import annotations

from typing import Annotated, Final

from aiohttp import web
from pydantic import BaseModel, Field

from app.api.bodies import Empty, json_answer, json_body
from app.api.models import Identifier, ListQuery, only_states_of
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import JOBS
from app.domain.jobs.job import Job, JobState
from app.domain.ports.stores import JobFilter
from app.services.access import Role
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobUpdate, VehicleQueueView

_ONE_JOB: Final = f"{API}/jobs/{{job_id}}"

_States = Annotated[
    str, only_states_of(JobState), Field(description="comma-separated states, for example queued,prepared")
]


class JobsQuery(ListQuery):
    """Filters for jobs. `open`: only unfinished jobs. `older_than`: the page after this job, taken from `next`."""

    vehicle: Identifier | None = None
    plan: Identifier | None = None
    state: _States | None = None
    open: bool = False
    older_than: Identifier | None = None

    def wanted(self) -> JobFilter:
        """Convert to the query of the service."""
        return JobFilter(
            vehicle_id=self.vehicle,
            plan_id=self.plan,
            states=frozenset(JobState(part) for part in self.state.split(",")) if self.state else frozenset(),
            open_only=self.open,
            older_than=self.older_than,
        )


class JobsView(BaseModel):
    """Jobs, newest first. Pass `next` as `older_than` to get the next page; it is null on the last page."""

    jobs: list[Job]
    next: str | None = None


async def create_job(call: Call[NoQuery, JobRequest]) -> web.Response:
    job = await call.request.app[JOBS].create(call.body, actor=call.principal.name)
    return _accepted(job)


async def check_job(call: Call[NoQuery, JobRequest]) -> web.Response:
    return json_answer(await call.request.app[JOBS].check(call.body))


async def list_jobs(call: Call[JobsQuery, Empty]) -> web.Response:
    query = call.query
    found = await call.request.app[JOBS].list_jobs(query.limit + 1, query.wanted())
    page = list(found[: query.limit])
    return json_answer(JobsView(jobs=page, next=page[-1].id if len(found) > query.limit else None))


async def get_job(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[JOBS].get(call.path_value("job_id")))


async def update_job(call: Call[NoQuery, JobUpdate]) -> web.Response:
    jobs = call.request.app[JOBS]
    return json_answer(await jobs.move(call.path_value("job_id"), call.body, actor=call.principal.name))


async def cancel_job(call: Call[NoQuery, Empty]) -> web.Response:
    return _accepted(await call.request.app[JOBS].cancel(call.path_value("job_id"), actor=call.principal.name))


def _accepted(job: Job) -> web.Response:
    return json_answer(job, status=202, headers={"Location": f"{API}/jobs/{job.id}"})


_PLAN_ERRORS: Final = ("resource.not_found", "plan.invalid", "storage.failed")
_ACCEPTED: Final = Answer(202, "The job. Poll Location or read the stream to follow it", Job, headers=("Location",))

JOB_ROUTES: tuple[AnyRoute, ...] = tagged(
    "jobs",
    Route(
        method="POST",
        path=f"{API}/jobs",
        handler=create_job,
        summary="Create a job: queue a plan for one vehicle or any suitable one",
        role=Role.DISPATCHER,
        body=json_body(JobRequest, with_plan=True),
        answers=(_ACCEPTED,),
        errors=(*_PLAN_ERRORS, "plan.rejected", "job.queue_full", "input.invalid"),
        idempotent=True,
    ),
    Route(
        method="POST",
        path=f"{API}/job-checks",
        handler=check_job,
        is_audited=False,
        summary="Check which vehicle a job would get now and why others are unsuitable; creates nothing",
        role=Role.DISPATCHER,
        body=json_body(JobRequest, with_plan=True),
        answers=(Answer(200, "The choice. The status is 200 even if no vehicle is suitable", AssignmentView),),
        errors=_PLAN_ERRORS,
    ),
    Route(
        method="GET",
        path=f"{API}/jobs",
        handler=list_jobs,
        summary="List jobs, newest first",
        role=Role.VIEWER,
        query=JobsQuery,
        answers=(Answer(200, "The jobs", JobsView),),
        errors=("resource.not_found", "storage.failed"),
    ),
    Route(
        method="GET",
        path=_ONE_JOB,
        handler=get_job,
        summary="Get a job; for a waiting job, includes what blocks each vehicle",
        role=Role.VIEWER,
        answers=(Answer(200, "The job", Job),),
        errors=_PLAN_ERRORS,
    ),
    Route(
        method="PATCH",
        path=_ONE_JOB,
        handler=update_job,
        summary="Update the priority or position of a waiting job",
        role=Role.DISPATCHER,
        body=json_body(JobUpdate),
        answers=(Answer(200, "The updated job", Job),),
        errors=("resource.not_found", "job.wrong_state", "storage.failed"),
    ),
    Route(
        method="POST",
        path=f"{_ONE_JOB}/cancel",
        handler=cancel_job,
        summary="Cancel a job that has not started",
        role=Role.DISPATCHER,
        answers=(_ACCEPTED,),
        errors=("resource.not_found", "job.wrong_state", "storage.failed"),
    ),
)


# /job-queues: the order of waiting jobs, and the queue of each vehicle, which operators stop and resume.


_ONE_QUEUE: Final = f"{API}/job-queues/{{vehicle_id}}"
_VIEW: Final = Answer(200, "The queue", VehicleQueueView)


async def get_job_queues(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[JOBS].queues())


async def stop_job_queue(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[JOBS].stop(call.path_value("vehicle_id"), call.principal.name))


async def resume_job_queue(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[JOBS].resume(call.path_value("vehicle_id"), call.principal.name))


QUEUE_ROUTES: tuple[AnyRoute, ...] = tagged(
    "jobs",
    Route(
        method="GET",
        path=f"{API}/job-queues",
        handler=get_job_queues,
        summary="List waiting jobs in order, and the state of each vehicle's queue",
        role=Role.VIEWER,
        answers=(Answer(200, "The queues", JobQueuesView),),
    ),
    Route(
        method="POST",
        path=f"{_ONE_QUEUE}/stop",
        handler=stop_job_queue,
        summary="Stop a vehicle's job queue; a run in flight continues",
        role=Role.DISPATCHER,
        answers=(_VIEW,),
        errors=("resource.not_found", "storage.failed"),
    ),
    Route(
        method="POST",
        path=f"{_ONE_QUEUE}/resume",
        handler=resume_job_queue,
        summary="Resume a vehicle's job queue after an inspection",
        role=Role.PILOT,
        answers=(_VIEW,),
        errors=("resource.not_found", "storage.failed"),
    ),
)
