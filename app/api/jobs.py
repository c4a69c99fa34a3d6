"""/jobs: plans that wait for a vehicle. /job-checks: which vehicle a job would get now."""

from __future__ import annotations

from typing import Annotated, Final

from aiohttp import web
from pydantic import BaseModel, Field

from app.api.bodies import Empty, json_answer, json_body
from app.api.models import Identifier, ListQuery, only_states_of
from app.api.routing import API, STORED, Answer, Call, NoQuery, Routes
from app.domain.errors import InvalidInputError
from app.domain.jobs.job import Job, JobState
from app.domain.ports.stores import JobFilter
from app.services.access import Role
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobUpdate, VehicleQueueView

ROUTES: Final = Routes("jobs")


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


_PLAN_ERRORS: Final = (*STORED, "plan.invalid", "plan.work_timeout")
_ACCEPTED: Final = Answer(202, "The job. Poll Location or read the stream to follow it", Job, headers=("Location",))


@ROUTES.route(
    "POST",
    "/jobs",
    Role.DISPATCHER,
    _ACCEPTED,
    body=json_body(JobRequest, with_plan=True),
    errors=(*_PLAN_ERRORS, "plan.rejected", "job.queue_full", "input.invalid"),
)
async def create_job(call: Call[NoQuery, JobRequest]) -> web.Response:
    """Create a job: queue a plan for one vehicle or any suitable one."""
    jobs, answer = call.services.jobs, call.answered(_accepted)
    return _accepted(await jobs.create(call.body, actor=call.principal.name, answer=answer))


@ROUTES.route(
    "POST",
    "/job-checks",
    Role.DISPATCHER,
    Answer(200, "The choice. The status is 200 even if no vehicle is suitable", AssignmentView),
    body=json_body(JobRequest, with_plan=True),
    errors=(*_PLAN_ERRORS, "input.invalid"),
    is_audited=False,
)
async def check_job(call: Call[NoQuery, JobRequest]) -> web.Response:
    """Check which vehicle a job would get now and why others are unsuitable; creates nothing."""
    return json_answer(await call.services.jobs.check(call.body))


@ROUTES.route("GET", "/jobs", Role.VIEWER, Answer(200, "The jobs", JobsView), errors=STORED)
async def list_jobs(call: Call[JobsQuery, Empty]) -> web.Response:
    """List jobs, newest first."""
    query = call.query
    found = await call.services.jobs.list_jobs(query.limit + 1, query.wanted())
    page = list(found[: query.limit])
    return json_answer(JobsView(jobs=page, next=page[-1].id if len(found) > query.limit else None))


@ROUTES.route("GET", "/jobs/{job_id}", Role.VIEWER, Answer(200, "The job", Job), errors=_PLAN_ERRORS)
async def get_job(call: Call[NoQuery, Empty]) -> web.Response:
    """Get a job; for a waiting job, includes what blocks each vehicle."""
    return json_answer(await call.services.jobs.get(call.path_value("job_id")))


@ROUTES.route(
    "PATCH",
    "/jobs/{job_id}",
    Role.DISPATCHER,
    Answer(200, "The updated job", Job),
    errors=(*STORED, "job.wrong_state", "input.invalid"),
)
async def update_job(call: Call[NoQuery, JobUpdate]) -> web.Response:
    """Update the priority or position of a waiting job."""
    job_id = call.path_value("job_id")
    if call.body.before == job_id:
        raise InvalidInputError("a job cannot wait before itself", hint="name another waiting job in before")
    return json_answer(await call.services.jobs.move(job_id, call.body, actor=call.principal.name))


@ROUTES.route("POST", "/jobs/{job_id}/cancel", Role.DISPATCHER, _ACCEPTED, errors=(*STORED, "job.wrong_state"))
async def cancel_job(call: Call[NoQuery, Empty]) -> web.Response:
    """Cancel a job that has not started."""
    return _accepted(await call.services.jobs.cancel(call.path_value("job_id"), actor=call.principal.name))


@ROUTES.route(
    "POST",
    "/jobs/{job_id}/clear-claim",
    Role.PILOT,
    Answer(200, "The job, which waits again, or has ended if that was requested", Job),
    errors=(*STORED, "job.wrong_state"),
)
async def clear_job_claim(call: Call[NoQuery, Empty]) -> web.Response:
    """Take a job from a gateway that does not answer and has not started it; another gateway may then get the job.

    Make sure that the gateway is switched off, or that its vehicle stays on the ground: it may fly the job later.
    """
    return json_answer(await call.services.jobs.clear_claim(call.path_value("job_id"), actor=call.principal.name))


def _accepted(job: Job) -> web.Response:
    return json_answer(job, status=202, headers={"Location": f"{API}/jobs/{job.id}"})


_VIEW: Final = Answer(200, "The queue", VehicleQueueView)


@ROUTES.route("GET", "/job-queues", Role.VIEWER, Answer(200, "The queues", JobQueuesView))
async def get_job_queues(call: Call[NoQuery, Empty]) -> web.Response:
    """List waiting jobs in order, and the state of each vehicle's queue."""
    return json_answer(await call.services.jobs.queues())


@ROUTES.route("POST", "/job-queues/{vehicle_id}/stop", Role.DISPATCHER, _VIEW, errors=STORED)
async def stop_job_queue(call: Call[NoQuery, Empty]) -> web.Response:
    """Stop a vehicle's job queue; a run in flight continues."""
    return json_answer(await call.services.jobs.stop(call.path_value("vehicle_id"), call.principal.name))


@ROUTES.route("POST", "/job-queues/{vehicle_id}/resume", Role.PILOT, _VIEW, errors=STORED)
async def resume_job_queue(call: Call[NoQuery, Empty]) -> web.Response:
    """Resume a vehicle's job queue after an inspection."""
    return json_answer(await call.services.jobs.resume(call.path_value("vehicle_id"), call.principal.name))
