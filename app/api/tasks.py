"""/vehicles/{id}/tasks: the task queue. Every request except GET requires the offboard lease and renews it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Literal

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import Empty, json_answer
from app.api.models import Identifier
from app.api.offboard.models import LeaseUse
from app.api.routing import Answer, Call, NoQuery, Routes
from app.api.services import TASKS
from app.domain.offboard.tasks.forms import InsertMode, Motion, Task, TaskPoint, TaskTerms, WhenEmpty
from app.services.access import Role
from app.services.tasks import TaskQueueService
from app.services.views import TasksView

ROUTES: Final = Routes("tasks")

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


_VIEW: Final = Answer(200, "The queue", TasksView)
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


@ROUTES.route("GET", "/vehicles/{vehicle_id}/tasks", Role.VIEWER, _VIEW, errors=("resource.not_found",))
async def get_tasks(call: Call[NoQuery, Empty]) -> web.Response:
    """Get the task queue, current task first."""
    return json_answer(_queue_service(call).view())


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/tasks",
    Role.PILOT,
    Answer(201, "The task was queued", TaskQueued, headers=("Location",)),
    errors=(*_LEASE, "task.refused", "task.queue_full"),
)
async def queue_task(call: Call[NoQuery, TaskRequest]) -> web.Response:
    """Queue a task: append, prepend, replace_current or replace_all."""
    service, body = _queue_service(call), call.body
    entry = service.insert(body.lease, body.task, body.insert, body.when_empty)
    answer = TaskQueued(task_id=entry.id, queue=service.view())
    return json_answer(answer, status=201, headers={"Location": call.request.path})


@ROUTES.route(
    "POST",
    "/vehicles/{vehicle_id}/tasks/{task_id}/target",
    Role.PILOT,
    _VIEW,
    errors=(*_LEASE, "task.refused"),
    is_audited=False,
)
async def move_target(call: Call[NoQuery, TargetRequest]) -> web.Response:
    """Update the target of a goto task."""
    service, body = _queue_service(call), call.body
    service.retarget(body.lease, call.path_value("task_id"), body.point, body.motion)
    return json_answer(service.view())


@ROUTES.route(
    "PATCH",
    "/vehicles/{vehicle_id}/tasks/{task_id}",
    Role.PILOT,
    _VIEW,
    errors=(*_LEASE, "task.refused", "task.active"),
)
async def update_task(call: Call[NoQuery, ChangeRequest]) -> web.Response:
    """Update the duration, speed, altitude or radius of a task that has not started."""
    service, body = _queue_service(call), call.body
    service.change(body.lease, call.path_value("task_id"), body.change)
    return json_answer(service.view())


@ROUTES.route("POST", "/vehicles/{vehicle_id}/tasks/{task_id}/move", Role.PILOT, _VIEW, errors=_LEASE)
async def move_task(call: Call[NoQuery, MoveRequest]) -> web.Response:
    """Move a task in the queue; a task moved to the front starts at once."""
    service, body = _queue_service(call), call.body
    service.move(body.lease, call.path_value("task_id"), body.before)
    return json_answer(service.view())


@ROUTES.route("DELETE", "/vehicles/{vehicle_id}/tasks/{task_id}", Role.PILOT, _VIEW, errors=_LEASE)
async def remove_task(call: Call[NoQuery, LeaseUse]) -> web.Response:
    """Remove a task; removing the current task skips it."""
    service = _queue_service(call)
    service.remove(call.body.lease, call.path_value("task_id"))
    return json_answer(service.view())


def _add_action(action: QueueAction, summary: str) -> None:
    async def handler(call: Call[NoQuery, LeaseUse]) -> web.Response:
        service = _queue_service(call)
        ACTIONS[action](service, call.body.lease)
        return json_answer(service.view())

    handler.__name__ = f"{action}_task" if action == "next" else f"{action}_tasks"
    handler.__doc__ = summary
    path, is_urgent = f"/vehicles/{{vehicle_id}}/tasks/{action}", action == "pause"
    ROUTES.route("POST", path, Role.PILOT, _VIEW, errors=_LEASE, is_urgent=is_urgent)(handler)


for _action, _summary in _SUMMARIES.items():
    _add_action(_action, _summary)
