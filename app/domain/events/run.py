"""Events of a run."""

from __future__ import annotations

from enum import StrEnum
from typing import ClassVar, Literal

from app.domain.airspace.rally import RallyDestination
from app.domain.drop.consent import ConsentChecks, ConsentRecord, ConsentState
from app.domain.drop.record import DropRecord
from app.domain.events.kinds import EventKind, Payload, WholePayload
from app.domain.model import FrozenForm
from app.domain.prediction.timeline import Timeline
from app.domain.reasons import Reason
from app.domain.run.attachment import Attachment
from app.domain.run.run import PlanChange, Run
from app.domain.targets import TargetEvidence
from app.domain.validation.finding import Finding
from app.domain.vehicle.commands import CommandAck, MavResultName
from app.domain.vehicle.state import FlightMode


class RunCreated(WholePayload[Run]):
    """The run."""

    kind: ClassVar = EventKind.RUN_CREATED


class RunChanged(WholePayload[Run]):
    """The run after a change."""

    kind: ClassVar = EventKind.RUN_CHANGED


class RunContinued(WholePayload[Run]):
    """The finished run; `continued_by` flies its remaining items. Stored in one transaction with that run."""

    kind: ClassVar = EventKind.RUN_CONTINUED


class RunPredicted(WholePayload[Timeline]):
    """The timeline predicted for this vehicle before the flight; at most its first 500 visits."""

    kind: ClassVar = EventKind.RUN_PREDICTED


class RunPlanRefused(Payload):
    """The check at a start found errors, with the parameters at that time. The vehicle was not armed.

    `parameters_age_s` is null if they were not read since the link was lost.
    """

    kind: ClassVar = EventKind.RUN_PLAN_REFUSED

    code: str
    findings: tuple[Finding, ...]
    parameters_age_s: float | None = None


class RunUploadProgress(Payload):
    """`sent` of `total` items of a list were uploaded."""

    kind: ClassVar = EventKind.RUN_UPLOAD_PROGRESS

    mission_type: Literal["mission", "fence", "rally"]
    sent: int
    total: int
    attempt: int
    percent: float


class RunMissionChanged(Payload):
    """The vehicle has the changed mission. `timeline` is predicted for the remaining items."""

    kind: ClassVar = EventKind.RUN_MISSION_CHANGED

    change: PlanChange
    timeline: Timeline


class HorizontalPosition(FrozenForm):
    """A horizontal position."""

    latitude_deg: float
    longitude_deg: float


class RunTargetMoved(Payload):
    """A waypoint was moved to where its target will be in `after_s`. The run now flies `plan_id`."""

    kind: ClassVar = EventKind.RUN_TARGET_MOVED

    plan_item_id: str
    waypoint_id: str
    plan_id: str
    moved_from: HorizontalPosition
    moved_to: HorizontalPosition
    from_planned_m: float
    after_s: float
    target: TargetEvidence


class RunTargetNotFollowed(Payload):
    """The waypoint was not moved. Recorded once per reason code; `target` null: no report yet."""

    kind: ClassVar = EventKind.RUN_TARGET_NOT_FOLLOWED

    plan_item_id: str
    waypoint_id: str
    feed: str
    reason: Reason
    target: TargetEvidence | None


class RunItem(Payload):
    """The vehicle flies to a plan item, or has reached it. `seq` is the mission item."""

    kind: ClassVar = EventKind.RUN_ITEM

    item_id: str | None
    seq: int
    phase: Literal["current", "reached"]


class RunItemEnded(Payload):
    """Start and end of an item on the vehicle's clock (seconds since boot; null if not observed).

    The run was paused for `paused_s` of it.
    """

    kind: ClassVar = EventKind.RUN_ITEM_ENDED

    item_id: str
    began_s: float | None
    ended_s: float | None
    paused_s: float = 0.0


class RunCommandName(StrEnum):
    """A command of a run. A release has the name of its MAV_CMD."""

    ARM = "arm"
    DISARM = "disarm"
    START_MISSION = "start_mission"
    SET_CURRENT = "set_current"
    CHANGE_MISSION = "change_mission"
    HOLD = "hold"
    PAUSE = "pause"
    RESUME = "resume"
    RETURN = "return"
    LAND = "land"
    DO_GRIPPER = "DO_GRIPPER"
    DO_WINCH = "DO_WINCH"


class RunCommand(Payload):
    """A command to the vehicle, stored before it is sent.

    `params` are the command's parameters (null is NaN), `attempt` counts from 1. `action` is the gripper action before
    takeoff. `failed_drop_id` is the failed drop that caused it, `previous_mode` the mode that a vehicle on the ground
    left, `rally` the destination of a return, `change` the mission change.
    """

    kind: ClassVar = EventKind.RUN_COMMAND

    command: RunCommandName
    params: tuple[float | None, ...] | None = None
    attempt: int | None = None
    action: Literal["grab"] | None = None
    failed_drop_id: str | None = None
    previous_mode: FlightMode | None = None
    rally: RallyDestination | None = None
    change: PlanChange | None = None


class CommandOutcome(StrEnum):
    """The result of a recorded command."""

    ACKNOWLEDGED = "acknowledged"
    """A COMMAND_ACK arrived, with `result`."""
    DONE = "done"
    """Its effect was observed: the mode, the item, the mission."""
    FAILED = "failed"
    """It failed: `detail` says why."""
    NOT_SENT = "not_sent"
    """It was not sent: `detail` says why."""
    UNKNOWN = "unknown"
    """Its effect was not observed."""


class RunAck(Payload):
    """The result of a command. `result` and `result_code` are the MAV_RESULT of a COMMAND_ACK, null without one.

    `result` is also null for a `result_code` that MAVLink does not define.
    """

    kind: ClassVar = EventKind.RUN_ACK

    command: RunCommandName
    outcome: CommandOutcome
    result: MavResultName | None = None
    result_code: int | None = None
    progress: int | None = None
    attempt: int | None = None
    detail: str = ""


def answer(command: RunCommandName, ack: CommandAck, attempt: int | None = None) -> RunAck:
    """A COMMAND_ACK, as received."""
    return RunAck(
        command=command,
        outcome=CommandOutcome.ACKNOWLEDGED,
        result=ack.result,
        result_code=ack.result_code,
        progress=ack.progress,
        attempt=attempt,
    )


class RunDrop(WholePayload[DropRecord]):
    """The record of the drop."""

    kind: ClassVar = EventKind.RUN_DROP


class RunAttachment(WholePayload[Attachment]):
    """An attachment. Its file is stored beside the journal."""

    kind: ClassVar = EventKind.RUN_ATTACHMENT


class DropConsentAsked(Payload):
    """Consent was requested until `deadline_at` (Unix seconds). `checked` has the measurements at that time."""

    kind: ClassVar = EventKind.DROP_CONSENT_ASKED

    plan_item_id: str
    question: int
    deadline_at: float | None
    checked: ConsentChecks | None


class DropConsentClosed(Payload):
    """The consent request ended. A grant is stored before a release is sent."""

    kind: ClassVar = EventKind.DROP_CONSENT_CLOSED

    plan_item_id: str
    question: int
    state: ConsentState
    actor: str | None
    comment: str = ""
    reason: Reason | None = None


def consent_event(
    plan_item_id: str, before: ConsentRecord | None, after: ConsentRecord | None
) -> DropConsentAsked | DropConsentClosed | None:
    """The event that records a change of a drop's consent, besides the record itself."""
    if after is None or after == before or after.state is ConsentState.PENDING:
        return None
    if after.state is ConsentState.ASKED:
        return DropConsentAsked(
            plan_item_id=plan_item_id,
            question=after.question,
            deadline_at=after.deadline_at,
            checked=after.checked,
        )
    return DropConsentClosed(
        plan_item_id=plan_item_id,
        question=after.question,
        state=after.state,
        actor=after.answered_by,
        comment=after.comment,
        reason=after.reason,
    )
