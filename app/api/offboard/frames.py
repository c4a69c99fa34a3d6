"""What the offboard websocket carries, both ways: one JSON object in each text frame, told apart by `type`."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, Final, Literal

from pydantic import BaseModel, Field, RootModel

from app.api.models import Identifier
from app.api.offboard.models import AuditView, ClampView, Destination, RateHz, StrictRequest
from app.api.tasks import QueueAction
from app.api.websockets import ErrorFrame, FrameId
from app.domain.offboard.setpoints import Setpoint
from app.domain.offboard.tasks.forms import InsertMode, Motion, Task, TaskPoint, TaskTerms, WhenEmpty
from app.services.views import FlownBy, OffboardView, TasksView


class ClientFrame(StrictRequest):
    """Every frame of the client may have an `id`. Any of them renews the lease."""

    id: FrameId | None = None


class AcquireLeaseFrame(ClientFrame):
    """Acquire the lease. It ends with the socket."""

    type: Literal["acquire_lease"]
    rate_hz: RateHz | None = None
    override: bool = False


class RenewLeaseFrame(ClientFrame):
    """Keep the lease while nothing else is sent."""

    type: Literal["renew_lease"]


class EnterFrame(ClientFrame):
    """Enter OFFBOARD mode. Send setpoints meanwhile. `flown_by` null: as the vehicle's tasks are flown."""

    type: Literal["enter"]
    sticks_held: bool = False
    flown_by: FlownBy | None = None


class SetpointFrame(ClientFrame):
    """The newest setpoint, at any rate. It is never sent when it is older than 0.4 s."""

    type: Literal["setpoint"]
    setpoint: Setpoint


class LeaveFrame(ClientFrame):
    """Leave OFFBOARD mode."""

    type: Literal["leave"]
    to: Destination = "hold"


class HandOverLeaseFrame(ClientFrame):
    """Offer the lease to somebody; null withdraws the offer."""

    type: Literal["hand_over_lease"]
    to: Identifier | None


class TaskFrame(ClientFrame):
    """Queue a task; flown when its turn comes and the vehicle is under offboard control."""

    type: Literal["task"]
    task: Task
    insert: InsertMode = "append"
    when_empty: WhenEmpty | None = None


class QueueFrame(ClientFrame):
    """An action on the whole task queue."""

    type: Literal["queue"]
    action: QueueAction


class MoveFrame(ClientFrame):
    """Move a task in the queue: before that other task; null: last. What becomes the first is flown at once."""

    type: Literal["move"]
    task_id: Identifier
    before: Identifier | None


class ChangeFrame(ClientFrame):
    """Change fields of a task that has not begun."""

    type: Literal["change"]
    task_id: Identifier
    change: TaskTerms


class RemoveFrame(ClientFrame):
    """Remove one task; removing the current one skips it."""

    type: Literal["remove"]
    task_id: Identifier


class TargetFrame(ClientFrame):
    """Where the target of a goto is now, and how it moves."""

    type: Literal["target"]
    task_id: Identifier
    point: TaskPoint
    motion: Motion | None = None


class ReleaseLeaseFrame(ClientFrame):
    """Release the lease; a vehicle in offboard control is told to hold."""

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


class ClientDocument(RootModel[AnyClientFrame]):
    """One frame of the client."""


class StateFrame(BaseModel):
    """How offboard control is: on every change, and a few times a second while setpoints are sent."""

    type: Literal["state"] = "state"
    offboard: OffboardView


class LeaseGrantedFrame(BaseModel):
    """The lease is the client's."""

    type: Literal["lease_granted"] = "lease_granted"
    id: int | None = None
    holder: str
    expires_in_s: float


class SetpointAckFrame(BaseModel):
    """The setpoint is accepted, as it is or clamped."""

    type: Literal["setpoint_ack"] = "setpoint_ack"
    id: int | None = None
    clamped: list[ClampView]


class QueuedFrame(BaseModel):
    """The task is in the queue."""

    type: Literal["queued"] = "queued"
    id: int | None = None
    task_id: str


class TasksFrame(BaseModel):
    """The task queue: on every change, and once a second from the first task on."""

    type: Literal["tasks"] = "tasks"
    queue: TasksView


class DoneFrame(BaseModel):
    """The command is done. After `enter`: the audited parameters."""

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
CLIENT_FRAMES: Final[tuple[type[BaseModel], ...]] = (
    AcquireLeaseFrame,
    RenewLeaseFrame,
    EnterFrame,
    SetpointFrame,
    TaskFrame,
    QueueFrame,
    MoveFrame,
    ChangeFrame,
    RemoveFrame,
    TargetFrame,
    LeaveFrame,
    HandOverLeaseFrame,
    ReleaseLeaseFrame,
)


class OffboardCloseCode(IntEnum):
    """Why the service closed an offboard websocket."""

    GOING_AWAY = 1001
    DEFECT = 1011
    TRY_AGAIN = 1013
    UNAUTHORIZED = 4401
    ROLE = 4403
    NO_VEHICLE = 4404
    LEASE_ENDED = 4410


CLOSE_REASONS: Final[dict[OffboardCloseCode, str]] = {
    OffboardCloseCode.GOING_AWAY: "the service stops",
    OffboardCloseCode.DEFECT: "a defect of the service",
    OffboardCloseCode.TRY_AGAIN: "the token cannot be looked at now",
    OffboardCloseCode.UNAUTHORIZED: "a valid token is needed",
    OffboardCloseCode.ROLE: "the role pilot is needed",
    OffboardCloseCode.NO_VEHICLE: "there is no such vehicle",
    OffboardCloseCode.LEASE_ENDED: "the lease has ended; what was still to be read is dropped",
}
"""Told with the code, for people; at most 123 bytes (RFC 6455)."""
