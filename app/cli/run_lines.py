"""One line of text for each event of a run."""

from __future__ import annotations

from datetime import datetime

from rich.text import Text

from app.domain.drop import DropOutcome, DropRecord, OutputEvidence
from app.domain.events import Event
from app.domain.events.run import (
    CommandOutcome,
    DropConsentAsked,
    DropConsentClosed,
    RunAck,
    RunChanged,
    RunCommand,
    RunContinued,
    RunCreated,
    RunDrop,
    RunItem,
    RunMissionChanged,
    RunTargetMoved,
    RunTargetNotFollowed,
)
from app.domain.events.service import SimulatorFault
from app.domain.events.vehicle import VehicleLinkLost, VehicleLinkRestored, VehicleRebooted, VehicleStatusText
from app.domain.reason import in_words
from app.domain.run import Run

_STYLES = {
    "released": "bold green",
    "kept": "bold yellow",
    "unknown": "bold red",
    "completed": "bold green",
    "failed": "bold red",
    "aborted": "bold yellow",
    "lost": "bold red",
}


NO_OUTPUT = ", warning: no output is assigned to the gripper, its acknowledgement proves nothing"


def run_line(event: Event) -> Text | None:
    """What a person is told of an event; None for those that only drive the progress bar."""
    told = _told(event)
    if told is None:
        return None
    clock = datetime.fromtimestamp(event.time).strftime("%H:%M:%S")
    return Text.assemble((f"{clock} ", "dim"), told)


def _told(event: Event) -> Text | None:
    match event.data:
        case RunCreated(root=run) | RunChanged(root=run):
            return _state(run)
        case RunMissionChanged(change=change):
            return Text(f"flies plan {change.plan_id} from {change.continue_at} on, changed by {change.by}")
        case RunContinued(root=run):
            return Text(f"what was left is flown by run {run.continued_by}")
        case RunTargetMoved() as moved:
            return Text(f"{moved.waypoint_id} follows its target, {moved.from_planned_m:.0f} m from the planned point")
        case RunTargetNotFollowed() as missed:
            return Text(
                f"{missed.waypoint_id} does not follow its target: {in_words(missed.reason)}", style="bold yellow"
            )
        case RunItem(what=what, item_id=item_id):
            return Text(f"{'flies to' if what == 'current' else 'reached'} {item_id}")
        case RunCommand() as command:
            return _command(command)
        case RunAck() as ack:
            return _ack(ack)
        case RunDrop(root=drop):
            return _drop(drop)
        case DropConsentAsked() | DropConsentClosed() as consent:
            return _consent(event, consent)
        case VehicleStatusText(severity=severity, text=text):
            return Text(f"vehicle says ({severity}): {text}", style="dim")
        case VehicleLinkLost() | VehicleLinkRestored() | VehicleRebooted():
            return Text(event.kind.value.removeprefix("vehicle.").replace("_", " "), style="bold yellow")
        case SimulatorFault() as fault:
            problem = f", not set: {fault.problem}" if fault.problem else ""
            return Text(f"simulated fault {fault.fault} = {fault.value}{problem}", style="bold yellow")
        case _:
            return None


def _state(run: Run) -> Text:
    state = run.state.value
    line = Text.assemble("run is ", (state.replace("_", " "), _STYLES.get(state, "bold")))
    if run.reason:
        line.append(f": {in_words(run.reason)}")
    return line


def _command(command: RunCommand) -> Text:
    what = " to close the gripper" if command.action == "grab" else ""
    again = "" if command.attempt in {None, 1} else f", try {command.attempt}"
    return Text(f"sends {command.command}{what}{again}")


def _ack(ack: RunAck) -> Text:
    if ack.outcome is not CommandOutcome.ACKNOWLEDGED:
        why = f": {ack.detail}" if ack.detail else ""
        return Text.assemble(f"{ack.command}: ", (ack.outcome.value.replace("_", " "), "bold"), why)
    progress = f" {ack.progress}%" if ack.result == "IN_PROGRESS" and ack.progress is not None else ""
    return Text.assemble(f"ack of {ack.command}: ", (f"{ack.result}{progress}", "bold"))


def _drop(drop: DropRecord) -> Text:
    line = Text(f"drop {drop.plan_item_id}: ")
    if drop.outcome is DropOutcome.PENDING:
        line.append(drop.phase.value)
        no_output = drop.output_evidence is OutputEvidence.NOT_ASSIGNED
        return line.append(NO_OUTPUT, style="bold yellow") if no_output else line
    style = "bold yellow" if drop.rests_on_an_ack_alone else _STYLES.get(drop.outcome.value, "bold")
    line.append(f"{drop.outcome.value} ({drop.certainty.value})", style=style)
    if drop.offset_m is not None:
        line.append(f", {drop.offset_m:.1f} m from the point")
    if drop.reason:
        line.append(f": {in_words(drop.reason)}")
    return line


def _consent(event: Event, consent: DropConsentAsked | DropConsentClosed) -> Text:
    drop = consent.plan_item_id
    if isinstance(consent, DropConsentAsked):
        until = datetime.fromtimestamp(consent.deadline_at or event.time).strftime("%H:%M:%S")
        answer = f"waydrop runs consent {event.run_id} {drop} --question {consent.question} --grant or --refuse"
        return Text(f"drop {drop} asks for consent until {until}: {answer}", style="bold magenta")
    by = f" by {consent.by}" if consent.by else ""
    said = consent.comment or in_words(consent.reason)
    why = f": {said}" if said else ""
    return Text(f"consent to {drop}: {consent.state.value.replace('_', ' ')}{by}{why}", style="bold")
