"""What the outside is shown of a vehicle that is flown by hand."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from app.domain.offboard.state import Lease, OffboardState
from app.domain.reason import Reason


class LeaseView(BaseModel):
    """Who has the vehicle, and for how long still. The lease's id is its holder's secret and not shown."""

    model_config = ConfigDict(frozen=True)

    holder: str
    expires_in_s: float
    offered_to: str | None

    @classmethod
    def of(cls, lease: Lease, now_s: float) -> LeaseView:
        """Of this lease."""
        left_s = round(max(0.0, lease.expires_s - now_s), 1)
        return cls(holder=lease.holder, expires_in_s=left_s, offered_to=lease.offered_to)


class SentView(BaseModel):
    """The newest setpoint that was sent. `by`: the client, the dead-man's zero velocity, or the guidance of a task."""

    model_config = ConfigDict(frozen=True)

    by: Literal["client", "dead_man", "task"]
    setpoint: dict[str, Any]
    message: str
    type_mask: int
    age_s: float
    clamped: list[str]


class CadenceView(BaseModel):
    """The rate asked for and the one held, and the intervals between the last sends."""

    model_config = ConfigDict(frozen=True)

    wanted_hz: float
    held_hz: float | None
    p50_ms: float | None
    p99_ms: float | None
    max_ms: float | None


class OrderView(BaseModel):
    """The newest command of whoever flies by hand, and its answer.

    `command`: DO_SET_MODE on the way in and out; of a wing flown by commands DO_REPOSITION (without a place: circle
    here) or DO_ORBIT; `altitude_m` is AMSL, a positive `radius_m` clockwise. `result`: `sent`, `no answer`, or the
    MAV_RESULT of its COMMAND_ACK.
    """

    model_config = ConfigDict(frozen=True)

    command: str
    latitude_deg: float | None
    longitude_deg: float | None
    altitude_m: float | None
    radius_m: float | None
    result: str
    age_s: float


FlownBy = Literal["setpoints", "commands"]
TaskState = Literal["idle", "waiting", "flying", "standing", "paused", "by_hand", "ending"]


class TaskReport(BaseModel):
    """The status report of the task queue, as Paparazzi's MISSION_STATUS.

    `remaining_s` of the current task, -1 if it has no limit. `task_list`: the types, current first (1 goto, 2 circle,
    3 segment, 4 path), [0] when empty. `state`: `idle` (nothing to fly), `waiting` for offboard control, `flying`,
    `standing` (no task is left, it waits for the next), `paused` (it stands, a wing circles), `by_hand` (a setpoint of
    the client's took over; resume goes on), `ending` (control goes back to the plan).
    """

    model_config = ConfigDict(frozen=True)

    state: TaskState
    remaining_s: float
    task_list: list[int]
    current_id: str | None
    reason: Reason | None


class OffboardView(BaseModel):
    """Offboard control of one vehicle. `reason` says why it is so, or why the last lease ended.

    `flown_by`: setpoints in OFFBOARD mode, or commands in Hold. Null: no lease. `order` is the newest command.
    """

    model_config = ConfigDict(frozen=True)

    state: OffboardState
    lease: LeaseView | None
    reason: Reason | None
    sent: SentView | None
    cadence: CadenceView | None
    tasks: TaskReport | None
    flown_by: FlownBy | None = None
    order: OrderView | None = None
