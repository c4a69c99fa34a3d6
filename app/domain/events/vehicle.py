"""Events of a vehicle outside its runs."""

from __future__ import annotations

from typing import ClassVar, Literal

from app.domain.events.kinds import EventKind, Payload
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.offboard.tasks.forms import GripperAction, InsertMode, Task
from app.domain.reasons import Reason
from app.domain.vehicle.facts import MavSeverity
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import FlightMode, LandedState, VehicleType, VtolState


class VehicleSeen(Payload):
    """A vehicle was discovered, or its identity became known."""

    kind: ClassVar = EventKind.VEHICLE_SEEN

    system_id: int
    vehicle_type: VehicleType | None
    uid: str | None
    firmware: str | None
    connection: str


class VehicleLinkLost(Payload):
    """No HEARTBEAT was received for too long."""

    kind: ClassVar = EventKind.VEHICLE_LINK_LOST

    last_heartbeat_age_s: float


class VehicleLinkRestored(Payload):
    """HEARTBEATs are received again."""

    kind: ClassVar = EventKind.VEHICLE_LINK_RESTORED


class VehicleChanged(Payload):
    """Mode or arming changed. `in_failsafe`: the autopilot chose the mode, not a user."""

    kind: ClassVar = EventKind.VEHICLE_CHANGED

    mode: FlightMode | None
    armed: bool | None
    landed: LandedState
    in_failsafe: bool
    vtol_state: VtolState | None


class VehicleParameters(Payload):
    """Parameters that Waydrop uses were changed by another client."""

    kind: ClassVar = EventKind.VEHICLE_PARAMETERS

    parameters: dict[str, int | float]


class VehicleRebooted(Payload):
    """The vehicle's time since boot went back."""

    kind: ClassVar = EventKind.VEHICLE_REBOOTED


class VehicleStatusText(Payload):
    """A STATUSTEXT, or a PX4 EVENT with a known text."""

    kind: ClassVar = EventKind.VEHICLE_STATUS_TEXT

    severity: MavSeverity
    text: str
    repeated: int = 0
    """So often it came again since it was last told; 0: it is told for the first time."""


class VehicleQuarantined(Payload):
    """Two vehicles seem to have its system ID: no commands are sent but Hold, Return and Land until that ends."""

    kind: ClassVar = EventKind.VEHICLE_QUARANTINED

    reason: Reason


class VehicleQuarantineEnded(Payload):
    """One vehicle is left. `actor`: the user who decided that; null if no second one was heard for 30 s."""

    kind: ClassVar = EventKind.VEHICLE_QUARANTINE_ENDED

    actor: str | None = None


class VehicleCommandedInQuarantine(Payload):
    """Hold, Return or Land is sent although the vehicle is quarantined: another vehicle may obey too."""

    kind: ClassVar = EventKind.VEHICLE_COMMANDED_IN_QUARANTINE

    mode: FlightMode


class VehicleLinkSecurity(Payload):
    """What keeps others from speaking for the vehicle is now another; see docs/explanation/security.md."""

    kind: ClassVar = EventKind.VEHICLE_LINK_SECURITY

    security: LinkSecurity


class VehicleLinkKey(Payload):
    """A user lets the vehicle have a signing key: stored before it is sent, and once more with what became of it."""

    kind: ClassVar = EventKind.VEHICLE_LINK_KEY

    actor: str
    outcome: Literal["sent", "done", "failed"]
    fingerprint: str | None = None
    reason: Reason | None = None


VehicleAction = Literal["hold", "return", "land"]


class VehicleCommand(Payload):
    """A user's command outside a run: stored before it is sent, and again with its result."""

    kind: ClassVar = EventKind.VEHICLE_COMMAND

    command: VehicleAction
    actor: str
    outcome: Literal["sent", "done", "failed"]
    reason: Reason | None = None


class OffboardLease(Payload):
    """The offboard lease changed. `other` held it before, or is the principal it is offered to."""

    kind: ClassVar = EventKind.OFFBOARD_LEASE

    change: LeaseChange
    holder: str
    other: str | None = None
    reason: Reason | None = None


class OffboardChanged(Payload):
    """The state of offboard control changed. Setpoints themselves are telemetry."""

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
    """The task queue changed. `task_list` are the remaining tasks, `task_id` and `task` the task concerned.

    `insert_mode` is set for an inserted task.
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
    """The gripper action of a task: stored before it is sent, and again with its result."""

    kind: ClassVar = EventKind.TASK_GRIPPER

    task_id: str
    action: GripperAction
    outcome: Literal["sent", "done", "failed", "unknown"]
    reason: Reason | None = None
