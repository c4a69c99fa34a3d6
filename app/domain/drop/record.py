"""The outcome of a drop and its certainty."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from app.domain.drop.consent import ConsentRecord
from app.domain.model import FrozenForm
from app.domain.reasons import Reason, ReasonCode
from app.domain.targets import TargetEvidence
from app.domain.vehicle.commands import MavResultName
from app.domain.vehicle.state import GnssFix, LandedState, Picture, VehicleState

MOST_PICTURES: Final = 16


class DropOutcome(StrEnum):
    """The outcome of a drop. `pending` only while the run is in progress."""

    PENDING = "pending"
    RELEASED = "released"
    KEPT = "kept"
    UNKNOWN = "unknown"


class Certainty(StrEnum):
    """What the outcome rests on, strongest first. PX4's ACCEPTED is a timer, so it is at most `acknowledged`."""

    SENSED = "sensed"
    ACKNOWLEDGED = "acknowledged"
    INFERRED = "inferred"
    NONE = "none"


class OutputEvidence(StrEnum):
    """What the gripper output (SERVO_OUTPUT_RAW) shows about a release.

    `not_assigned`: no PWM_*_FUNCn is 430, so no output can move (also for a CAN gripper). `not_known`: parameters did
    not answer. `not_seen`: an output is assigned, but no pulse with a known meaning was received in time.
    """

    MOVED = "moved"
    NOT_MOVED = "not_moved"
    NOT_SEEN = "not_seen"
    NOT_ASSIGNED = "not_assigned"
    NOT_KNOWN = "not_known"


class DropPhase(StrEnum):
    """The phase of a drop. An embedded drop has only waiting and done; asking requires consent."""

    WAITING = "waiting"
    HOLDING = "holding"
    ASKING = "asking"
    RELEASING = "releasing"
    DONE = "done"


class GripperUse(StrEnum):
    """Who used the gripper in flight besides the drop and the mission: nothing shows what the drop released then."""

    TASK = "task"
    OTHERS = "others"

    def doubt(self, otherwise: Reason) -> Reason:
        """Why the outcome is unknown; `otherwise`: how the drop would have ended."""
        is_task = self is GripperUse.TASK
        return Reason.of(ReasonCode.DROP_GRIPPER_BY_TASK if is_task else ReasonCode.ITEM_STRAYED, otherwise)


class DropRecord(FrozenForm):
    """The evidence of one drop. Times are in Unix seconds; offsets are metres from the planned point.

    Measurements (`latitude_deg` to `battery_percent`) are taken when the release is sent or the item is passed.
    `relative_altitude_m` is above the home of the takeoff, `absolute_altitude_m` above mean sea level.

    `commanded_at` is when a release was sent, `acknowledged_*` the answer of the vehicle (COMMAND_ACK of DO_GRIPPER),
    `output_*` the gripper output of the autopilot (SERVO_OUTPUT_RAW), `sensed_at` when a sensor detected the release.
    They are never merged. PX4's grippers have no sensor, so `sensed_at` stays None. `output_evidence` classifies the
    output, even before the release if no evidence is possible; None for a winch, and while undecided.

    `pictures` are those taken closest to the drop.

    `gripper_used_by`: before the drop, a task of offboard control was about to use the gripper, or its output was seen
    at release where the mission does not release. The drop can only end as `unknown` then.

    `consent` is None if the plan does not request it; `target` is None without a moving target or a report of it.
    `alternate_to` is the failed drop of which this one is the alternate. Such a record exists only after the vehicle
    was sent there.
    """

    plan_item_id: str
    supervised: bool
    alternate_to: str | None = None
    phase: DropPhase = DropPhase.WAITING
    consent: ConsentRecord | None = None
    outcome: DropOutcome = DropOutcome.PENDING
    certainty: Certainty = Certainty.NONE
    reason: Reason | None = None
    attempts: int = 0
    commanded_at: float | None = None
    acknowledged_at: float | None = None
    acknowledged_result: MavResultName | None = None
    output_at: float | None = None
    output_us: int | None = None
    output_evidence: OutputEvidence | None = None
    sensed_at: float | None = None
    gripper_used_by: GripperUse | None = None
    planned_latitude_deg: float | None = None
    planned_longitude_deg: float | None = None
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    relative_altitude_m: float | None = None
    absolute_altitude_m: float | None = None
    heading_deg: float | None = None
    ground_speed_m_s: float | None = None
    offset_m: float | None = None
    landed: LandedState | None = None
    gnss_fix: GnssFix | None = None
    gnss_satellites: int | None = None
    gnss_hdop: float | None = None
    battery_percent: float | None = None
    target: TargetEvidence | None = None
    pictures: tuple[Picture, ...] = ()

    def having_seen(self, before: VehicleState, now: VehicleState) -> DropRecord:
        """Add what the vehicle reported near the drop between two observations."""
        picture = now.picture
        if picture is None or picture in (before.picture, *self.pictures) or len(self.pictures) >= MOST_PICTURES:
            return self
        return self.model_copy(update={"pictures": (*self.pictures, picture)})

    @property
    def rests_on_an_ack_alone(self) -> bool:
        """Whether it was released by acknowledgement only, without an observed movement. PX4 acknowledges without a
        gripper too.
        """
        moved = self.output_evidence in (None, OutputEvidence.MOVED)
        return self.outcome is DropOutcome.RELEASED and self.certainty is Certainty.ACKNOWLEDGED and not moved
