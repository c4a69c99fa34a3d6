"""Events of a run."""

from __future__ import annotations

from enum import StrEnum
from typing import Literal

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


class RunCreated(WholePayload[Run], kind=EventKind.RUN_CREATED):
    """The run."""


class RunChanged(WholePayload[Run], kind=EventKind.RUN_CHANGED):
    """The run after a change."""


class RunContinued(WholePayload[Run], kind=EventKind.RUN_CONTINUED):
    """The finished run; `continued_by` flies its remaining items. Stored in one transaction with that run."""


class RunTakenOver(WholePayload[Run], kind=EventKind.RUN_TAKEN_OVER):
    """The run, which this gateway follows from now on. `taken_over` names the gateway that did before: its journal has
    the earlier events. A run that has ended there is stored here with its end.
    """


class RunPredicted(WholePayload[Timeline], kind=EventKind.RUN_PREDICTED):
    """The timeline predicted for this vehicle before the flight; at most its first 500 visits."""


class RunPlanRefused(Payload, kind=EventKind.RUN_PLAN_REFUSED):
    """The check at a start found errors, with the parameters at that time. The vehicle was not armed.

    `parameters_age_s` is null if they were not read since the link was lost.
    """

    code: str
    findings: tuple[Finding, ...]
    parameters_age_s: float | None = None


class RunUploadProgress(Payload, kind=EventKind.RUN_UPLOAD_PROGRESS):
    """`sent` of `total` items of a list were uploaded."""

    mission_type: Literal["mission", "fence", "rally"]
    sent: int
    total: int
    attempt: int
    percent: float


class RunMissionChanged(Payload, kind=EventKind.RUN_MISSION_CHANGED):
    """The vehicle has the changed mission. `timeline` is predicted for the remaining items."""

    change: PlanChange
    timeline: Timeline


class HorizontalPosition(FrozenForm):
    """A horizontal position."""

    latitude_deg: float
    longitude_deg: float


class RunTargetMoved(Payload, kind=EventKind.RUN_TARGET_MOVED):
    """A waypoint was moved to where its target will be in `after_s`. The run now flies `plan_id`."""

    plan_item_id: str
    waypoint_id: str
    plan_id: str
    moved_from: HorizontalPosition
    moved_to: HorizontalPosition
    from_planned_m: float
    after_s: float
    target: TargetEvidence


class RunTargetNotFollowed(Payload, kind=EventKind.RUN_TARGET_NOT_FOLLOWED):
    """The waypoint was not moved. Recorded once per reason code; `target` null: no report yet."""

    plan_item_id: str
    waypoint_id: str
    feed: str
    reason: Reason
    target: TargetEvidence | None


class RunItem(Payload, kind=EventKind.RUN_ITEM):
    """The vehicle flies to a plan item, or has reached it. `seq` is the mission item."""

    item_id: str | None
    seq: int
    phase: Literal["current", "reached"]


class RunItemEnded(Payload, kind=EventKind.RUN_ITEM_ENDED):
    """Start and end of an item on the vehicle's clock (seconds since boot; null if not observed).

    The run was paused for `paused_s` of it.
    """

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
    DO_SET_HOME = "DO_SET_HOME"


class RunCommand(Payload, kind=EventKind.RUN_COMMAND):
    """A command to the vehicle, stored before it is sent.

    `params` are the command's parameters (null is NaN), `attempt` counts from 1. `action` is the gripper action before
    takeoff. `failed_drop_id` is the failed drop that caused it, `previous_mode` the mode that a vehicle on the ground
    left, `rally` the destination of a return, `change` the mission change.
    """

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
    """The command failed; `detail` has the reason."""
    NOT_SENT = "not_sent"
    """The command was not sent; `detail` has the reason."""
    UNKNOWN = "unknown"
    """Its effect was not observed."""


class RunAck(Payload, kind=EventKind.RUN_ACK):
    """The result of a command. `result` and `result_code` are the MAV_RESULT of a COMMAND_ACK, null without one.

    `result` is also null for a `result_code` that MAVLink does not define.
    """

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


class RunDrop(WholePayload[DropRecord], kind=EventKind.RUN_DROP):
    """The record of the drop."""


class RunAttachment(WholePayload[Attachment], kind=EventKind.RUN_ATTACHMENT):
    """An attachment. Its file is stored beside the journal."""


class DropConsentAsked(Payload, kind=EventKind.DROP_CONSENT_ASKED):
    """Consent was requested until `deadline_at` (Unix seconds). `checked` has the measurements at that time."""

    plan_item_id: str
    question: int
    deadline_at: float | None
    checked: ConsentChecks | None


class DropConsentClosed(Payload, kind=EventKind.DROP_CONSENT_CLOSED):
    """The consent request ended. A grant is stored before a release is sent."""

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


RunPayload = (
    RunCreated
    | RunChanged
    | RunPredicted
    | RunPlanRefused
    | RunUploadProgress
    | RunMissionChanged
    | RunContinued
    | RunTakenOver
    | RunTargetMoved
    | RunTargetNotFollowed
    | RunItem
    | RunItemEnded
    | RunCommand
    | RunAck
    | RunDrop
    | RunAttachment
    | DropConsentAsked
    | DropConsentClosed
)
