"""/job-queues: the order of what waits, and the queue of each vehicle, which operators stop and resume."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from app.api.answers import json_answer
from app.api.bodies import NO_BODY, Empty
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import JOBS
from app.services.access import Role
from app.services.jobs.views import JobQueuesView, VehicleQueueView

_ONE: Final = f"{API}/job-queues/{{vehicle_id}}"
_VIEW: Final = Answer(200, "The queue as it is now", VehicleQueueView)


async def get_job_queues(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /job-queues."""
    return json_answer(await call.request.app[JOBS].queues())


async def stop_job_queue(call: Call[NoQuery, Empty]) -> web.Response:
    """POST /job-queues/{vehicle_id}/stop."""
    return json_answer(await call.request.app[JOBS].stop(call.path_value("vehicle_id"), call.principal.name))


async def resume_job_queue(call: Call[NoQuery, Empty]) -> web.Response:
    """POST /job-queues/{vehicle_id}/resume."""
    return json_answer(await call.request.app[JOBS].resume(call.path_value("vehicle_id"), call.principal.name))


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="GET",
        path=f"{API}/job-queues",
        handler=get_job_queues,
        summary="What waits, in order, and how each vehicle's queue stands",
        tag="jobs",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "The queues", JobQueuesView),),
    ),
    Route(
        method="POST",
        path=f"{_ONE}/stop",
        handler=stop_job_queue,
        summary="Begin and start no more jobs on this vehicle; a run that flies goes on",
        tag="jobs",
        role=Role.DISPATCHER,
        query=NoQuery,
        body=NO_BODY,
        answers=(_VIEW,),
        errors=("not_found", "storage.failed"),
    ),
    Route(
        method="POST",
        path=f"{_ONE}/resume",
        handler=resume_job_queue,
        summary="Go on after somebody has looked at the vehicle",
        tag="jobs",
        role=Role.PILOT,
        query=NoQuery,
        body=NO_BODY,
        answers=(_VIEW,),
        errors=("not_found", "storage.failed"),
    ),
)
