"""Events of a vehicle outside its runs."""

from __future__ import annotations

from typing import Literal

from app.domain.events.kinds import EventKind, Payload
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.offboard.tasks.forms import GripperAction, InsertMode, Task
from app.domain.reasons import Reason
from app.domain.vehicle.facts import MavSeverity
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import FlightMode, LandedState, VehicleType, VtolState


class VehicleSeen(Payload, kind=EventKind.VEHICLE_SEEN):
    """A vehicle was discovered, or its identity became known."""

    system_id: int
    vehicle_type: VehicleType | None
    uid: str | None
    firmware: str | None
    connection: str


class VehicleLinkLost(Payload, kind=EventKind.VEHICLE_LINK_LOST):
    """No HEARTBEAT was received for too long."""

    last_heartbeat_age_s: float


class VehicleLinkRestored(Payload, kind=EventKind.VEHICLE_LINK_RESTORED):
    """HEARTBEATs are received again."""


class VehicleChanged(Payload, kind=EventKind.VEHICLE_CHANGED):
    """Mode or arming changed. `in_failsafe`: the autopilot chose the mode, not a user. `is_terminated`: it has stopped
    the motors, by a failsafe or the kill switch.
    """

    mode: FlightMode | None
    armed: bool | None
    landed: LandedState
    in_failsafe: bool
    is_terminated: bool = False
    vtol_state: VtolState | None


class VehicleParameters(Payload, kind=EventKind.VEHICLE_PARAMETERS):
    """Parameters that Waydrop uses were changed by another client."""

    parameters: dict[str, int | float]


class VehicleRebooted(Payload, kind=EventKind.VEHICLE_REBOOTED):
    """The vehicle's time since boot went back."""


class VehicleStatusText(Payload, kind=EventKind.VEHICLE_STATUS_TEXT):
    """A STATUSTEXT, or a PX4 EVENT with a known text."""

    severity: MavSeverity
    text: str
    repeated: int = 0
    """Number of repetitions since the text was last recorded; 0: first occurrence."""
    last_age_s: float | None = None
    """Of repetitions: how long before this event the last one came, in seconds. The text is not news then."""


class VehicleQuarantined(Payload, kind=EventKind.VEHICLE_QUARANTINED):
    """Two vehicles seem to have its system ID: no commands are sent but Hold, Return and Land until that ends."""

    reason: Reason


class VehicleQuarantineEnded(Payload, kind=EventKind.VEHICLE_QUARANTINE_ENDED):
    """One vehicle is left. `actor`: the user who decided that; null if no second one was heard for 30 s."""

    actor: str | None = None


class VehicleCommandedInQuarantine(Payload, kind=EventKind.VEHICLE_COMMANDED_IN_QUARANTINE):
    """Hold, Return or Land is sent although the vehicle is quarantined: another vehicle may obey too."""

    mode: FlightMode


class VehicleLinkSecurity(Payload, kind=EventKind.VEHICLE_LINK_SECURITY):
    """What keeps others from speaking for the vehicle is now another; see docs/explanation/security.md."""

    security: LinkSecurity


class VehicleLinkKey(Payload, kind=EventKind.VEHICLE_LINK_KEY):
    """A user lets the vehicle have a signing key: stored before it is sent, and once more with what became of it."""

    actor: str
    outcome: Literal["sent", "done", "failed"]
    fingerprint: str | None = None
    reason: Reason | None = None


VehicleAction = Literal["hold", "return", "land"]


class VehicleCommand(Payload, kind=EventKind.VEHICLE_COMMAND):
    """A user's command outside a run: stored before it is sent, and again with its result."""

    command: VehicleAction
    actor: str
    outcome: Literal["sent", "done", "failed"]
    reason: Reason | None = None


class OffboardLease(Payload, kind=EventKind.OFFBOARD_LEASE):
    """The offboard lease changed. `other` held it before, or is the principal it is offered to."""

    change: LeaseChange
    holder: str
    other: str | None = None
    reason: Reason | None = None


class OffboardChanged(Payload, kind=EventKind.OFFBOARD_CHANGED):
    """The state of offboard control changed. Setpoints themselves are telemetry."""

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


class TasksChanged(Payload, kind=EventKind.TASK_CHANGED):
    """The task queue changed. `task_list` are the remaining tasks, `task_id` and `task` the task concerned.

    `insert_mode` is set for an inserted task.
    """

    change: TaskChange
    task_id: str | None
    task: Task | None
    holder: str | None
    insert_mode: InsertMode | None = None
    reason: Reason | None = None
    task_list: tuple[int, ...]


GripperOutcome = Literal["sent", "done", "failed", "unknown"]


class TasksGripper(Payload, kind=EventKind.TASK_GRIPPER):
    """The gripper action of a task: stored before it is sent, and again with its result."""

    task_id: str
    action: GripperAction
    outcome: GripperOutcome
    reason: Reason | None = None


VehiclePayload = (
    VehicleSeen
    | VehicleLinkLost
    | VehicleLinkRestored
    | VehicleChanged
    | VehicleParameters
    | VehicleRebooted
    | VehicleStatusText
    | VehicleQuarantined
    | VehicleQuarantineEnded
    | VehicleCommandedInQuarantine
    | VehicleLinkSecurity
    | VehicleLinkKey
    | VehicleCommand
    | OffboardLease
    | OffboardChanged
    | TasksChanged
    | TasksGripper
)
