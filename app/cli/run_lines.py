"""One line of text for each event of a run."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from pydantic import ValidationError
from rich.text import Text

from app.domain.drop import DropRecord
from app.domain.events import Event, EventKind

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


def is_ack_alone(drop: dict[str, Any]) -> bool:
    """See DropRecord.rests_on_an_ack_alone; drops of older events say nothing of an output."""
    try:
        return DropRecord.model_validate(drop).rests_on_an_ack_alone
    except ValidationError:
        return False


def run_line(event: Event) -> Text | None:
    """What a person is told of an event; None for those that only drive the progress bar."""
    told = _told(event)
    if told is None:
        return None
    clock = datetime.fromtimestamp(event.time).strftime("%H:%M:%S")
    return Text.assemble((f"{clock} ", "dim"), told)


def _told(event: Event) -> Text | None:
    data = event.data
    match event.kind:
        case EventKind.RUN_CREATED | EventKind.RUN_CHANGED:
            return _state(data)
        case EventKind.RUN_MISSION_CHANGED:
            change = data.get("change") or {}
            who = f" by {change['by']}" if change.get("by") else ""
            return Text(f"flies plan {change.get('plan_id')} from {change.get('continue_at')} on, changed{who}")
        case EventKind.RUN_CONTINUED:
            return Text(f"what was left is flown by run {data.get('continued_by')}")
        case EventKind.RUN_TARGET_MOVED | EventKind.RUN_TARGET_NOT_FOLLOWED:
            return _target(event)
        case EventKind.RUN_ITEM:
            verb = "flies to" if data.get("what") == "current" else "reached"
            return Text(f"{verb} {data.get('item_id')}")
        case EventKind.RUN_COMMAND:
            what = " to close the gripper" if data.get("action") == "grab" else ""
            return Text(f"sends {data.get('command')}{what}{_again(data)}")
        case EventKind.RUN_ACK:
            underway = data.get("result") == "IN_PROGRESS" and data.get("progress") is not None
            progress = f" {data['progress']}%" if underway else ""
            return Text.assemble(f"ack of {data.get('command')}: ", (f"{data.get('result')}{progress}", "bold"))
        case EventKind.RUN_DROP:
            return _drop(data)
        case EventKind.DROP_CONSENT_ASKED | EventKind.DROP_CONSENT_CLOSED:
            return _consent(event)
        case EventKind.VEHICLE_STATUS_TEXT:
            return Text(f"vehicle says ({data.get('severity')}): {data.get('text')}", style="dim")
        case EventKind.VEHICLE_LINK_LOST | EventKind.VEHICLE_LINK_RESTORED | EventKind.VEHICLE_REBOOTED:
            return Text(event.kind.value.removeprefix("vehicle.").replace("_", " "), style="bold yellow")
        case EventKind.SIMULATOR_FAULT:
            problem = f", not set: {data['problem']}" if data.get("problem") else ""
            return Text(f"simulated fault {data.get('fault')} = {data.get('value')}{problem}", style="bold yellow")
        case _:
            return None


def _state(run: dict[str, Any]) -> Text:
    state = str(run.get("state"))
    line = Text.assemble("run is ", (state.replace("_", " "), _STYLES.get(state, "bold")))
    if run.get("reason"):
        line.append(f": {run['reason']}")
    return line


def _drop(drop: dict[str, Any]) -> Text:
    outcome = str(drop.get("outcome"))
    line = Text(f"drop {drop.get('plan_item_id')}: ")
    if outcome == "pending":
        line.append(str(drop.get("phase")))
        return line.append(NO_OUTPUT, style="bold yellow") if drop.get("output_evidence") == "not_assigned" else line
    alone = is_ack_alone(drop)
    line.append(f"{outcome} ({drop.get('certainty')})", style="bold yellow" if alone else _STYLES.get(outcome, "bold"))
    if drop.get("offset_m") is not None:
        line.append(f", {drop['offset_m']:.1f} m from the point")
    if drop.get("reason"):
        line.append(f": {drop['reason']}")
    return line


def _consent(event: Event) -> Text:
    data = event.data
    if event.kind is EventKind.DROP_CONSENT_ASKED:
        until = datetime.fromtimestamp(float(data.get("deadline_at") or event.time)).strftime("%H:%M:%S")
        drop = data.get("plan_item_id")
        answer = f"waydrop runs consent {event.run_id} {drop} --question {data.get('question')} --grant or --refuse"
        return Text(f"drop {drop} asks for consent until {until}: {answer}", style="bold magenta")
    by = f" by {data['by']}" if data.get("by") else ""
    why = f": {data['reason']}" if data.get("reason") else ""
    state = str(data.get("state")).replace("_", " ")
    return Text(f"consent to {data.get('plan_item_id')}: {state}{by}{why}", style="bold")


def _target(event: Event) -> Text:
    data = event.data
    if event.kind is EventKind.RUN_TARGET_MOVED:
        away_m = float(data.get("from_planned_m") or 0.0)
        return Text(f"{data.get('waypoint_id')} follows its target, {away_m:.0f} m from the planned point")
    return Text(f"{data.get('waypoint_id')} does not follow its target: {data.get('reason')}", style="bold yellow")


def _again(data: dict[str, Any]) -> str:
    attempt = data.get("attempt")
    return "" if attempt in {None, 1} else f", try {attempt}"
