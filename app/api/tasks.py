"""/vehicles/{id}/tasks: the task queue. Every request except GET requires the offboard lease and renews it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Final, Literal

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import Empty, json_answer
from app.api.models import Identifier
from app.api.offboard.models import LeaseUse
from app.api.offboard.routes import pilot_route
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import TASKS
from app.domain.offboard.tasks.forms import InsertMode, Motion, Task, TaskPoint, TaskTerms, WhenEmpty
from app.services.access import Role
from app.services.tasks import TaskQueueService
from app.services.views import TasksView

# Request and response models of the task queue.


QueueAction = Literal["next", "clear", "pause", "resume"]


class TaskRequest(LeaseUse):
    """Queue a task. `when_empty` is what happens after the last task: `plan` resumes the mission, `wait` holds. The
    newest value applies.
    """

    task: Task
    insert: InsertMode = "append"
    when_empty: WhenEmpty | None = None


class TargetRequest(LeaseUse):
    """The position of a goto task's target. With `motion`, the target is extrapolated for up to 5 s."""

    point: TaskPoint
    motion: Motion | None = None


class ChangeRequest(LeaseUse):
    """Fields to change of a task that has not started."""

    change: TaskTerms


class MoveRequest(LeaseUse):
    """The task to insert before; null moves the task to the end."""

    before: Identifier | None


class TaskQueued(BaseModel):
    """The ID of the task, and the queue."""

    task_id: str
    queue: TasksView


_PATH: Final = f"{API}/vehicles/{{vehicle_id}}/tasks"
_LEASE: Final = ("resource.not_found", "offboard.lease_lost", "state.conflict")
ACTIONS: Final[Mapping[QueueAction, Callable[[TaskQueueService, str], None]]] = {
    "next": TaskQueueService.skip,
    "clear": TaskQueueService.clear,
    "pause": TaskQueueService.pause,
    "resume": TaskQueueService.resume,
}
_SUMMARIES: Final[Mapping[QueueAction, str]] = {
    "next": "Skip to the next task",
    "clear": "Remove all tasks",
    "pause": "Pause the queue: the vehicle stops, a fixed wing loiters",
    "resume": "Resume the current task",
}


def _queue_service(call: Call[Any, Any]) -> TaskQueueService:
    return call.request.app[TASKS].vehicle(call.path_value("vehicle_id"))


async def get_tasks(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(_queue_service(call).view())


async def queue_task(call: Call[NoQuery, TaskRequest]) -> web.Response:
    service, body = _queue_service(call), call.body
    entry = service.insert(body.lease, body.task, body.insert, body.when_empty)
    answer = TaskQueued(task_id=entry.id, queue=service.view())
    return json_answer(answer, status=201, headers={"Location": call.request.path})


async def move_target(call: Call[NoQuery, TargetRequest]) -> web.Response:
    service, body = _queue_service(call), call.body
    service.retarget(body.lease, call.path_value("task_id"), body.point, body.motion)
    return json_answer(service.view())


async def update_task(call: Call[NoQuery, ChangeRequest]) -> web.Response:
    service, body = _queue_service(call), call.body
    service.change(body.lease, call.path_value("task_id"), body.change)
    return json_answer(service.view())


async def move_task(call: Call[NoQuery, MoveRequest]) -> web.Response:
    service, body = _queue_service(call), call.body
    service.move(body.lease, call.path_value("task_id"), body.before)
    return json_answer(service.view())


async def remove_task(call: Call[NoQuery, LeaseUse]) -> web.Response:
    service = _queue_service(call)
    service.remove(call.body.lease, call.path_value("task_id"))
    return json_answer(service.view())


def _doing(action: QueueAction) -> Callable[[Call[NoQuery, LeaseUse]], Awaitable[web.Response]]:
    async def handler(call: Call[NoQuery, LeaseUse]) -> web.Response:
        service = _queue_service(call)
        ACTIONS[action](service, call.body.lease)
        return json_answer(service.view())

    handler.__name__ = f"{action}_task" if action == "next" else f"{action}_tasks"
    return handler


_VIEW: Final = Answer(200, "The queue", TasksView)

ROUTES: tuple[AnyRoute, ...] = tagged(
    "tasks",
    Route(
        method="GET",
        path=_PATH,
        handler=get_tasks,
        summary="Get the task queue, current task first",
        role=Role.VIEWER,
        answers=(_VIEW,),
        errors=("resource.not_found",),
    ),
    pilot_route(
        _PATH,
        queue_task,
        TaskRequest,
        "Queue a task: append, prepend, replace_current or replace_all",
        answer=Answer(201, "The task was queued", TaskQueued, headers=("Location",)),
        errors=(*_LEASE, "task.refused", "task.queue_full"),
        idempotent=True,
    ),
    pilot_route(
        f"{_PATH}/{{task_id}}/target",
        move_target,
        TargetRequest,
        "Update the target of a goto task",
        answer=_VIEW,
        errors=(*_LEASE, "task.refused"),
        is_audited=False,
    ),
    pilot_route(
        f"{_PATH}/{{task_id}}",
        update_task,
        ChangeRequest,
        "Update the duration, speed, altitude or radius of a task that has not started",
        answer=_VIEW,
        errors=(*_LEASE, "task.refused", "task.active"),
        method="PATCH",
    ),
    pilot_route(
        f"{_PATH}/{{task_id}}/move",
        move_task,
        MoveRequest,
        "Move a task in the queue; a task moved to the front starts at once",
        answer=_VIEW,
        errors=_LEASE,
    ),
    pilot_route(
        f"{_PATH}/{{task_id}}",
        remove_task,
        LeaseUse,
        "Remove a task; removing the current task skips it",
        answer=_VIEW,
        errors=_LEASE,
        method="DELETE",
    ),
    *(
        pilot_route(f"{_PATH}/{action}", _doing(action), LeaseUse, summary, answer=_VIEW, errors=_LEASE)
        for action, summary in _SUMMARIES.items()
    ),
)
