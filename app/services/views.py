"""What the outside is shown of a vehicle."""

from __future__ import annotations

from typing import Any, Literal

from app.domain.model import Frozen
from app.domain.offboard.state import Lease, OffboardState
from app.domain.offboard.tasks.course import EkfOrigin
from app.domain.offboard.tasks.forms import Task, WhenEmpty
from app.domain.reasons import Reason
from app.domain.vehicle.commands import MavResultName
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.performance import Performance
from app.domain.vehicle.state import (
    FlightMode,
    GnssFix,
    LandedState,
    MissionState,
    VehicleState,
    VehicleType,
    VtolState,
)


class LeaseView(Frozen):
    """Who has the vehicle, and for how long still. The lease's id is its holder's secret and not shown."""

    holder: str
    expires_in_s: float
    offered_to: str | None

    @classmethod
    def of(cls, lease: Lease, now_s: float) -> LeaseView:
        left_s = round(max(0.0, lease.expires_s - now_s), 1)
        return cls(holder=lease.holder, expires_in_s=left_s, offered_to=lease.offered_to)


class SentView(Frozen):
    """The newest setpoint that was sent. `source`: the client, the dead-man's zero velocity, or a task's guidance."""

    source: Literal["client", "dead_man", "task"]
    setpoint: dict[str, Any]
    message: str
    type_mask: int
    age_s: float
    clamped: list[str]


class RateView(Frozen):
    """The rate asked for and the one held, and the intervals between the last sends."""

    target_hz: float
    achieved_hz: float | None
    p50_ms: float | None
    p99_ms: float | None
    max_ms: float | None


SentCommandOutcome = Literal["sent", "acknowledged", "unanswered", "not_seen", "not_sent"]


class SentCommandView(Frozen):
    """The newest command of the client in control, and its answer.

    `command`: DO_SET_MODE on the way in and out; of a wing flown by commands DO_REPOSITION (without a place: circle
    here) or DO_ORBIT; `altitude_m` is AMSL, a positive `radius_m` clockwise. `outcome`: `sent` (no answer yet),
    `acknowledged` (`result` is the MAV_RESULT of its COMMAND_ACK), `unanswered`, `not_seen` (accepted, but the mode did
    not change), or `not_sent`.
    """

    command: str
    latitude_deg: float | None
    longitude_deg: float | None
    altitude_m: float | None
    radius_m: float | None
    outcome: SentCommandOutcome
    result: MavResultName | None
    age_s: float


ControlMethodName = Literal["setpoints", "commands"]
TaskState = Literal["idle", "waiting", "flying", "standing", "paused", "manual", "ending"]


class TaskReport(Frozen):
    """The status report of the task queue, as Paparazzi's MISSION_STATUS.

    `remaining_s` of the current task, -1 if it has no limit. `task_list`: the types, current first (1 goto, 2 circle, 3
    segment, 4 path), [0] when empty. `state`: `idle` (no tasks), `waiting` for offboard control, `flying`, `standing`
    (no task is left, it waits for the next), `paused` (it holds, a fixed wing circles), `manual` (the client sent a
    setpoint; `resume` continues), `ending` (control returns to the plan).
    """

    state: TaskState
    remaining_s: float
    task_list: list[int]
    current_id: str | None
    reason: Reason | None


class OffboardView(Frozen):
    """Offboard control of one vehicle. `reason` says why it is so, or why the last lease ended.

    `control_method`: setpoints in OFFBOARD mode, or commands in Hold. Null: no lease. `command` is the newest one.
    """

    state: OffboardState
    lease: LeaseView | None
    reason: Reason | None
    sent: SentView | None
    rate: RateView | None
    tasks: TaskReport | None
    control_method: ControlMethodName | None = None
    command: SentCommandView | None = None


class OriginView(Frozen):
    """The EKF origin, from which local east and north count: degrees, metres AMSL. It is not home, which moves."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    @classmethod
    def of(cls, origin: EkfOrigin) -> OriginView:
        """To a millimetre or so: it is reckoned back from home."""
        place = round(origin.latitude_deg, 8), round(origin.longitude_deg, 8)
        return cls(latitude_deg=place[0], longitude_deg=place[1], altitude_m=round(origin.altitude_m, 3))


class QueuedTaskView(Frozen):
    """One task. `remaining_s` is -1 without a limit. Of the current one also how far it is, null before it is flown.

    `cross_m`: metres beside its course, to the right positive. `remaining_m`: to its end, null where it has none.
    `leg`: of a path, counted from 0.
    """

    id: str
    task: Task
    remaining_s: float
    leg: int
    cross_m: float | None
    remaining_m: float | None


class TasksView(Frozen):
    """The queue of one vehicle, current task first. `origin` null: the vehicle has not reported it yet.

    `control_method`: how its tasks are flown; null: not supported, or its type is unknown.
    """

    report: TaskReport
    origin: OriginView | None
    when_empty: WhenEmpty
    control_method: ControlMethodName | None = None
    capacity: int
    tasks: list[QueuedTaskView]


class PositionView(Frozen):
    """A place: degrees, and metres AMSL."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float


class StateView(Frozen):
    """The newest measurements of a vehicle, with their ages in seconds; null is "never received"."""

    connected: bool
    link_security: LinkSecurity | None
    mode: FlightMode | None
    armed: bool | None
    landed: LandedState
    in_failsafe: bool
    is_terminated: bool
    latitude_deg: float | None
    longitude_deg: float | None
    absolute_altitude_m: float | None
    relative_altitude_m: float | None
    velocity_north_m_s: float | None
    velocity_east_m_s: float | None
    velocity_down_m_s: float | None
    heading_deg: float | None
    position_age_s: float | None
    heartbeat_age_s: float | None
    battery_percent: float | None
    home: PositionView | None
    mission_seq: int | None
    mission_total: int | None
    mission_state: MissionState
    mission_id: int | None
    vtol_state: VtolState | None
    gnss_fix: GnssFix | None
    gnss_satellites: int | None
    gnss_hdop: float | None
    gripper_output_us: int | None
    offboard: OffboardView | None

    @classmethod
    def of(cls, state: VehicleState, offboard: OffboardView | None = None) -> StateView:
        """The view of a state, and of who controls the vehicle in offboard mode."""
        home = state.home
        place = None if home is None else PositionView(**{n: getattr(home, n) for n in PositionView.model_fields})
        rest = {name: getattr(state, name) for name in cls.model_fields if name not in ("home", "offboard")}
        return cls(home=place, offboard=offboard, **rest)


class VehicleView(Frozen):
    """A vehicle as shown. `quarantined` says why no command but hold, return and land is sent to it, null if all are.

    `performance` is what the operator declares of it, null if nothing is declared.
    """

    id: str
    system_id: int
    vehicle_type: VehicleType | None
    firmware: str | None
    uid: str | None
    connection: str
    quarantined: Reason | None
    run_id: str | None
    performance: Performance | None
    state: StateView


class SiteStatus(Frozen):
    """What an API node knows of a site: whose reports it shows, and how old the newest one is.

    `connected`: reports arrive. `url` is where the gateway's own page and API are, empty if it does not say; `seq` is
    the newest event of its journal.
    """

    site: str
    gateway: str
    url: str
    connected: bool
    report_age_s: float
    seq: int
    vehicle_ids: tuple[str, ...]
