"""Frames of the offboard websocket, both directions: one JSON object per text frame, discriminated by `type`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final, Literal, get_args

from pydantic import BaseModel, Field, RootModel

from app.api.models import Identifier
from app.api.offboard.models import AuditView, ClampView, Destination, RateHz
from app.api.tasks import QueueAction
from app.api.websockets import COMMON_CLOSE_REASONS, READS_TEXT, CloseCode, ErrorFrame, FrameId
from app.domain.model import StrictForm
from app.domain.offboard.setpoints import Setpoint
from app.domain.offboard.tasks.forms import InsertMode, Motion, Task, TaskPoint, TaskTerms, WhenEmpty
from app.services.views import ControlMethodName, OffboardView, TasksView


class ClientFrame(StrictForm):
    """Base of client frames. Each may have an `id`, and each renews the lease."""

    id: FrameId | None = None


class AcquireLeaseFrame(ClientFrame):
    """Acquire the lease. It ends when the socket closes."""

    type: Literal["acquire_lease"]
    rate_hz: RateHz | None = None
    override: bool = False


class RenewLeaseFrame(ClientFrame):
    """Renew the lease without any other effect."""

    type: Literal["renew_lease"]


class EnterFrame(ClientFrame):
    """Enter OFFBOARD mode; keep sending setpoints. `control_method` null: the method used for the vehicle's tasks."""

    type: Literal["enter"]
    sticks_held: bool = False
    control_method: ControlMethodName | None = None


class SetpointFrame(ClientFrame):
    """The newest setpoint, at any rate. The service stops repeating it after 0.4 s."""

    type: Literal["setpoint"]
    setpoint: Setpoint


class LeaveFrame(ClientFrame):
    """Leave OFFBOARD mode."""

    type: Literal["leave"]
    to: Destination = "hold"


class HandOverLeaseFrame(ClientFrame):
    """Offer the lease to another principal; null withdraws the offer."""

    type: Literal["hand_over_lease"]
    to: Identifier | None


class TaskFrame(ClientFrame):
    """Queue a task. The vehicle flies it when the tasks before it are done and offboard control is active."""

    type: Literal["task"]
    task: Task
    insert: InsertMode = "append"
    when_empty: WhenEmpty | None = None


class QueueFrame(ClientFrame):
    """An action on the whole task queue."""

    type: Literal["queue"]
    action: QueueAction


class MoveFrame(ClientFrame):
    """Move a task in front of another one; null moves it to the end. A task moved to the front starts at once."""

    type: Literal["move"]
    task_id: Identifier
    before: Identifier | None


class ChangeFrame(ClientFrame):
    """Change fields of a task that has not started."""

    type: Literal["change"]
    task_id: Identifier
    change: TaskTerms


class RemoveFrame(ClientFrame):
    """Remove a task. Removing the current task skips it."""

    type: Literal["remove"]
    task_id: Identifier


class TargetFrame(ClientFrame):
    """The current position and motion of a goto task's target."""

    type: Literal["target"]
    task_id: Identifier
    point: TaskPoint
    motion: Motion | None = None


class ReleaseLeaseFrame(ClientFrame):
    """Release the lease. A vehicle under offboard control is commanded to hold."""

    type: Literal["release_lease"]


AnyClientFrame = Annotated[
    AcquireLeaseFrame
    | RenewLeaseFrame
    | EnterFrame
    | SetpointFrame
    | TaskFrame
    | QueueFrame
    | MoveFrame
    | ChangeFrame
    | RemoveFrame
    | TargetFrame
    | LeaveFrame
    | HandOverLeaseFrame
    | ReleaseLeaseFrame,
    Field(discriminator="type"),
]


def action_of(frame: AnyClientFrame) -> str | None:
    """What the audit calls a frame; None for setpoints, positions of targets and renewals, which come all the time."""
    match frame:
        case SetpointFrame() | TargetFrame() | RenewLeaseFrame():
            return None
        case QueueFrame(action=action):
            return f"queue.{action}"
        case _:
            return frame.type


class ClientDocument(RootModel[AnyClientFrame]):
    """Any frame of the client."""


class StateFrame(BaseModel):
    """The state of offboard control: sent on every change, and a few times per second while setpoints are sent."""

    type: Literal["state"] = "state"
    offboard: OffboardView


class LeaseGrantedFrame(BaseModel):
    """The client holds the lease."""

    type: Literal["lease_granted"] = "lease_granted"
    id: int | None = None
    holder: str
    expires_in_s: float


class SetpointAckFrame(BaseModel):
    """The setpoint was accepted, possibly clamped."""

    type: Literal["setpoint_ack"] = "setpoint_ack"
    id: int | None = None
    clamped: list[ClampView]


class QueuedFrame(BaseModel):
    """The task was queued."""

    type: Literal["queued"] = "queued"
    id: int | None = None
    task_id: str


class TasksFrame(BaseModel):
    """The task queue: sent on every change, and once per second after the first task was queued."""

    type: Literal["tasks"] = "tasks"
    queue: TasksView


class DoneFrame(BaseModel):
    """The command was executed. After `enter`, contains the audited parameters."""

    type: Literal["done"] = "done"
    id: int | None = None
    command: str
    audit: list[AuditView] = []


SERVER_FRAMES: Final[tuple[type[BaseModel], ...]] = (
    StateFrame,
    TasksFrame,
    LeaseGrantedFrame,
    SetpointAckFrame,
    QueuedFrame,
    DoneFrame,
    ErrorFrame,
)
CLIENT_FRAMES: Final[tuple[type[BaseModel], ...]] = get_args(get_args(AnyClientFrame)[0])


CLOSE_REASONS: Final[Mapping[CloseCode, str]] = {
    **COMMON_CLOSE_REASONS,
    **READS_TEXT,
    CloseCode.ROLE: "the role pilot is required",
    CloseCode.NO_VEHICLE: "unknown vehicle",
    CloseCode.LEASE_ENDED: "the lease has ended; unread frames were dropped",
}
