"""What requests and answers of the task queue look like."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel

from app.api.models import Identifier
from app.api.offboard_models import LeaseUse
from app.domain.tasks.forms import InsertMode, Motion, Task, TaskPoint, WhenEmpty
from app.domain.tasks.terms import TaskTerms
from app.services.task_view import TasksView

QueueAction = Literal["next", "clear", "pause", "resume"]


class TaskRequest(LeaseUse):
    """Queue a task. `when_empty`, once no task is left: `plan` gives control back, `wait` stands. The last counts."""

    task: Task
    insert: InsertMode = "append"
    when_empty: WhenEmpty | None = None


class TargetRequest(LeaseUse):
    """Where the target of a goto is now. With `motion` it is followed, and its last word holds for 5 s."""

    point: TaskPoint
    motion: Motion | None = None


class ChangeRequest(LeaseUse):
    """What of a task that has not begun shall be otherwise."""

    change: TaskTerms


class MoveRequest(LeaseUse):
    """Before which other task this one shall stand; null: last."""

    before: Identifier | None


class TaskQueued(BaseModel):
    """The task's id, and the queue with it."""

    task_id: str
    queue: TasksView
