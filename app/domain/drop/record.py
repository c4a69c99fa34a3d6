"""How a drop ended, and how sure that is."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from pydantic import BaseModel, ConfigDict

from app.domain.drop.consent import ConsentRecord
from app.domain.reasons import Reason
from app.domain.targets import TargetEvidence
from app.domain.vehicle.commands import MavResultName
from app.domain.vehicle.state import GnssFix, LandedState, Picture, VehicleState

MOST_PICTURES: Final = 16


class DropOutcome(StrEnum):
    """Every drop ends in one of these; `pending` only while the run goes on."""

    PENDING = "pending"
    RELEASED = "released"
    KEPT = "kept"
    UNKNOWN = "unknown"


class Certainty(StrEnum):
    """Why the outcome is believed, strongest first. PX4's ACCEPTED is a timer: never more than acknowledged."""

    SENSED = "sensed"
    ACKNOWLEDGED = "acknowledged"
    INFERRED = "inferred"
    NONE = "none"


class OutputEvidence(StrEnum):
    """What the gripper's output (SERVO_OUTPUT_RAW) says of a release.

    `not_assigned`: no PWM_*_FUNCn is 430, so that none can move (a CAN gripper looks alike). `not_known`: parameters
    did not answer. `not_seen`: it is assigned, and no pulse of a known meaning came in time.
    """

    MOVED = "moved"
    NOT_MOVED = "not_moved"
    NOT_SEEN = "not_seen"
    NOT_ASSIGNED = "not_assigned"
    NOT_KNOWN = "not_known"


class DropPhase(StrEnum):
    """Where a drop is. An embedded one is only waiting and done; only one that needs consent is asking."""

    WAITING = "waiting"
    HOLDING = "holding"
    ASKING = "asking"
    RELEASING = "releasing"
    DONE = "done"


class DropRecord(BaseModel):
    """The evidence of one drop. Times are Unix seconds; offsets are metres from the planned point.

    What was measured (`latitude_deg` to `battery_percent`) is of the moment at which the release was sent, or the item
    passed. `relative_altitude_m` is above home, `absolute_altitude_m` above mean sea level.

    `commanded_at` is when a release was sent, `acknowledged_*` what the vehicle answered (COMMAND_ACK of DO_GRIPPER),
    `output_*` what the autopilot put out to the gripper (SERVO_OUTPUT_RAW), `sensed_at` when a sensor saw the parcel
    go. They are never merged. PX4's grippers have no sensor: `sensed_at` stays None for them. `output_evidence` says in
    a word what the output shows, before the release already if it can show nothing; None for a winch, and while
    nothing can be said.

    `pictures` are those that were taken nearest to it.

    `consent` is None if the plan asks for none; `target` if the drop has no moving target, or none was reported of.
    `alternate_to` is the drop that failed before this one was tried at its
    alternate; such a record is there only once the vehicle was sent on.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

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
        """With what the vehicle told between two looks near the drop's place, before it or after."""
        picture = now.picture
        if picture is None or picture in (before.picture, *self.pictures) or len(self.pictures) >= MOST_PICTURES:
            return self
        return self.model_copy(update={"pictures": (*self.pictures, picture)})

    @property
    def rests_on_an_ack_alone(self) -> bool:
        """Released by the vehicle's word, and no output was seen to move: PX4 says the same where nothing can move."""
        moved = self.output_evidence in (None, OutputEvidence.MOVED)
        return self.outcome is DropOutcome.RELEASED and self.certainty is Certainty.ACKNOWLEDGED and not moved
