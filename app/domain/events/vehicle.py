"""Events of a vehicle, beside its runs."""

from __future__ import annotations

from typing import ClassVar, Literal

from app.domain.events.kinds import EventKind, Payload
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.offboard.tasks.forms import GripperAction, InsertMode, Task
from app.domain.reasons import Reason
from app.domain.vehicle.facts import MavSeverity
from app.domain.vehicle.state import FlightMode, LandedState, VehicleType, VtolState


class VehicleSeen(Payload):
    """A vehicle was found, or more is known of who it is."""

    kind: ClassVar = EventKind.VEHICLE_SEEN

    system_id: int
    vehicle_type: VehicleType | None
    uid: str | None
    firmware: str | None
    connection: str


class VehicleLinkLost(Payload):
    """No HEARTBEAT came for too long."""

    kind: ClassVar = EventKind.VEHICLE_LINK_LOST

    last_heartbeat_age_s: float


class VehicleLinkRestored(Payload):
    """HEARTBEATs come again."""

    kind: ClassVar = EventKind.VEHICLE_LINK_RESTORED


class VehicleChanged(Payload):
    """What changed is among these. `in_failsafe`: the autopilot, and no user, chose the mode."""

    kind: ClassVar = EventKind.VEHICLE_CHANGED

    mode: FlightMode | None
    armed: bool | None
    landed: LandedState
    in_failsafe: bool
    vtol_state: VtolState | None


class VehicleParameters(Payload):
    """Parameters that Waydrop uses and that have another value now: somebody set them."""

    kind: ClassVar = EventKind.VEHICLE_PARAMETERS

    parameters: dict[str, int | float]


class VehicleRebooted(Payload):
    """The vehicle's boot time jumped back."""

    kind: ClassVar = EventKind.VEHICLE_REBOOTED


class VehicleStatusText(Payload):
    """STATUSTEXT, or a PX4 EVENT whose text is known."""

    kind: ClassVar = EventKind.VEHICLE_STATUS_TEXT

    severity: MavSeverity
    text: str


class VehicleQuarantined(Payload):
    """No command is sent to it until it is released."""

    kind: ClassVar = EventKind.VEHICLE_QUARANTINED

    reason: Reason


VehicleAction = Literal["hold", "return", "land"]


class VehicleCommand(Payload):
    """A command that a user gave outside a run: stored before it is sent, and once more with what became of it."""

    kind: ClassVar = EventKind.VEHICLE_COMMAND

    command: VehicleAction
    actor: str
    outcome: Literal["sent", "done", "failed"]
    reason: Reason | None = None


class OffboardLease(Payload):
    """Who may control the vehicle in offboard mode. `other` had the lease before, or is the one it is offered to."""

    kind: ClassVar = EventKind.OFFBOARD_LEASE

    change: LeaseChange
    holder: str
    other: str | None = None
    reason: Reason | None = None


class OffboardChanged(Payload):
    """How far offboard control is. The setpoints themselves are telemetry."""

    kind: ClassVar = EventKind.OFFBOARD_CHANGED

    state: OffboardState
    holder: str | None
    reason: Reason | None = None


TaskChange = Literal[
    "inserted",
    "changed",
    "moved",
    "removed",
    "reached",
    "time_over",
    "gripper_done",
    "skipped",
    "cleared",
    "paused",
    "resumed",
    "manual",
    "blocked",
    "dropped",
]


class TasksChanged(Payload):
    """A change of the task queue. `task_list` are the tasks that are left, `task_id` and `task` the one concerned.

    `insert_mode` says where an inserted one went.
    """

    kind: ClassVar = EventKind.TASK_CHANGED

    change: TaskChange
    task_id: str | None
    task: Task | None
    holder: str | None
    insert_mode: InsertMode | None = None
    reason: Reason | None = None
    task_list: tuple[int, ...]


class TasksGripper(Payload):
    """A task's gripper action: stored before it is sent, and once more with what became of it."""

    kind: ClassVar = EventKind.TASK_GRIPPER

    task_id: str
    action: GripperAction
    outcome: Literal["sent", "done", "failed", "unknown"]
    reason: Reason | None = None
