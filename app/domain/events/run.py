"""Events of a run."""

from __future__ import annotations

from enum import StrEnum
from typing import ClassVar, Literal

from pydantic import BaseModel, ConfigDict

from app.domain.airspace.rally import RallyDestination
from app.domain.drop.consent import ConsentChecks, ConsentRecord, ConsentState
from app.domain.drop.record import DropRecord
from app.domain.events.kinds import EventKind, Payload, WholePayload
from app.domain.prediction.timeline import Timeline
from app.domain.reasons import Reason
from app.domain.run.attachment import Attachment
from app.domain.run.run import PlanChange, Run
from app.domain.targets import TargetEvidence
from app.domain.validation.finding import Finding
from app.domain.vehicle.commands import CommandAck, MavResultName
from app.domain.vehicle.state import FlightMode


class RunCreated(WholePayload[Run]):
    """The run, whole."""

    kind: ClassVar = EventKind.RUN_CREATED


class RunChanged(WholePayload[Run]):
    """The run, whole, after a change of it."""

    kind: ClassVar = EventKind.RUN_CHANGED


class RunContinued(WholePayload[Run]):
    """The run, which is over; `continued_by` flies what was left. Stored together with that run."""

    kind: ClassVar = EventKind.RUN_CONTINUED


class RunPredicted(WholePayload[Timeline]):
    """The timeline for this vehicle, as predicted before the flight; at most its first 500 visits."""

    kind: ClassVar = EventKind.RUN_PREDICTED


class RunPlanRefused(Payload):
    """The check at a start found errors, by the parameters as they were then; the vehicle was not armed.

    `parameters_age_s` is null if they were not read since the link was lost.
    """

    kind: ClassVar = EventKind.RUN_PLAN_REFUSED

    code: str
    findings: tuple[Finding, ...]
    parameters_age_s: float | None = None


class RunUploadProgress(Payload):
    """`sent` of `total` items of one list are on the vehicle."""

    kind: ClassVar = EventKind.RUN_UPLOAD_PROGRESS

    mission_type: Literal["mission", "fence", "rally"]
    sent: int
    total: int
    attempt: int
    percent: float


class RunMissionChanged(Payload):
    """The vehicle has the changed mission. `timeline` is predicted for the rest."""

    kind: ClassVar = EventKind.RUN_MISSION_CHANGED

    change: PlanChange
    timeline: Timeline


class Place(BaseModel):
    """A place over the ground."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    latitude_deg: float
    longitude_deg: float


class RunTargetMoved(Payload):
    """A waypoint was moved to where its target will be in `after_s`; the run flies `plan_id` now."""

    kind: ClassVar = EventKind.RUN_TARGET_MOVED

    plan_item_id: str
    waypoint_id: str
    plan_id: str
    moved_from: Place
    moved_to: Place
    from_planned_m: float
    after_s: float
    target: TargetEvidence


class RunTargetNotFollowed(Payload):
    """The waypoint stays where it is. Told once for each new reason's code; `target` null: nothing was reported yet."""

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
    """When the vehicle was busy with an item, by its own clock (s since it started; null if nobody saw it).

    In `paused_s` of them the run was paused.
    """

    kind: ClassVar = EventKind.RUN_ITEM_ENDED

    item_id: str
    began_s: float | None
    ended_s: float | None
    paused_s: float = 0.0


class RunCommandName(StrEnum):
    """What a run commands. A release has the name of its MAV_CMD."""

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

    `params` are the command's own (null is NaN), `attempt` counts from 1. `action` says what a gripper is told before
    the take-off. `failed_drop_id` is the drop whose failure it answers, `left_in` the mode out of which a vehicle on
    the ground is brought, `rally` where a return goes, `change` what a changed mission is.
    """

    kind: ClassVar = EventKind.RUN_COMMAND

    command: RunCommandName
    params: tuple[float | None, ...] | None = None
    attempt: int | None = None
    action: Literal["grab"] | None = None
    failed_drop_id: str | None = None
    left_in: FlightMode | None = None
    rally: RallyDestination | None = None
    change: PlanChange | None = None


class CommandOutcome(StrEnum):
    """What became of a command that was recorded."""

    ACKNOWLEDGED = "acknowledged"
    """A COMMAND_ACK came: `result` says which."""
    DONE = "done"
    """It was seen to be done: the mode, the item, the mission."""
    FAILED = "failed"
    """It was not done: `detail` says why."""
    NOT_SENT = "not_sent"
    """It was withheld: `detail` says why."""
    UNKNOWN = "unknown"
    """Nobody saw whether it was done."""


class RunAck(Payload):
    """What became of a command. `result` and `result_code` are the MAV_RESULT of a COMMAND_ACK, null where none came.

    `result` is null too for a `result_code` that MAVLink does not name.
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
    """A COMMAND_ACK, as it came."""
    return RunAck(
        command=command,
        outcome=CommandOutcome.ACKNOWLEDGED,
        result=ack.result,
        result_code=ack.result_code,
        progress=ack.progress,
        attempt=attempt,
    )


class RunDrop(WholePayload[DropRecord]):
    """The drop's record."""

    kind: ClassVar = EventKind.RUN_DROP


class RunAttachment(WholePayload[Attachment]):
    """The file itself lies beside the journal."""

    kind: ClassVar = EventKind.RUN_ATTACHMENT


class DropConsentAsked(Payload):
    """The vehicle holds; an operator is asked until `deadline_at` (Unix seconds). `checked` is what was measured."""

    kind: ClassVar = EventKind.DROP_CONSENT_ASKED

    plan_item_id: str
    question: int
    deadline_at: float | None
    checked: ConsentChecks | None


class DropConsentClosed(Payload):
    """The question is over. A grant is stored before a release is sent."""

    kind: ClassVar = EventKind.DROP_CONSENT_CLOSED

    plan_item_id: str
    question: int
    state: ConsentState
    actor: str | None
    comment: str = ""
    reason: Reason | None = None


def consent_told(
    plan_item_id: str, before: ConsentRecord | None, after: ConsentRecord | None
) -> DropConsentAsked | DropConsentClosed | None:
    """What a change of a drop's consent is told as, besides the record itself."""
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
