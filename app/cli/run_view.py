"""What `waydrop fly` shows: an upload bar, a line for each event, the drops, predicted against flown."""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import Final, Protocol, Self

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn
from rich.table import Table
from rich.text import Text

from app.cli.terminal import write_json
from app.cli.times import clock_time
from app.domain.delivery.comparison import Comparison, DropComparison, ItemComparison
from app.domain.drop.record import Certainty, DropOutcome, DropRecord, OutputEvidence
from app.domain.events import Event, RunPayload, ServicePayload, VehiclePayload, service, vehicle
from app.domain.events import run as events
from app.domain.reasons import describe
from app.domain.run.run import Run, RunState
from app.domain.vehicle.commands import MavResult

_STRENGTH: Final = {Certainty.NONE: 0, Certainty.INFERRED: 1, Certainty.ACKNOWLEDGED: 2, Certainty.SENSED: 3}
STRICT: Final = Certainty.ACKNOWLEDGED
"""The certainty required by --strict: an acknowledgement. PX4's grippers have no sensor, so `sensed` is a separate
option.
"""


@dataclass(frozen=True, slots=True)
class RunAssessment:
    """`reasons` is empty exactly if all was achieved."""

    reasons: tuple[str, ...]

    @property
    def achieved(self) -> bool:
        """Every drop was released with the certainty asked for, and the flight ended as its vehicle type ends."""
        return not self.reasons


def assess(run: Run, *, least: Certainty) -> RunAssessment:
    """Assess a run that is over. `least` is the weakest certainty that counts."""
    reasons = []
    if run.state is not RunState.COMPLETED:
        why = f": {describe(run.reason)}" if run.reason else ""
        reasons.append(f"the run is {run.state.value}{why}")
    for drop in run.last_drops:
        if drop.outcome is not DropOutcome.RELEASED:
            why = f": {describe(drop.reason)}" if drop.reason else ""
            reasons.append(f"drop {drop.plan_item_id} is {drop.outcome.value}{why}")
        elif _STRENGTH[drop.certainty] < _STRENGTH[least]:
            unseen = ": no movement of an output was observed" if drop.rests_on_an_ack_alone else ""
            reasons.append(
                f"drop {drop.plan_item_id} is only {drop.certainty.value}, but {least.value} was required{unseen}"
            )
    return RunAssessment(tuple(reasons))


_STYLES = {
    "released": "bold green",
    "kept": "bold yellow",
    "unknown": "bold red",
    "completed": "bold green",
    "failed": "bold red",
    "aborted": "bold yellow",
    "lost": "bold red",
}


NO_OUTPUT = ", warning: no output is assigned to the gripper, so its acknowledgement is no evidence"


def run_line(event: Event) -> Text | None:
    """The line that is printed for an event; None for events that only move the progress bar."""
    payload = event.data
    if isinstance(payload, RunPayload):
        line = _of_run(event, payload)
    elif isinstance(payload, VehiclePayload):
        line = _of_vehicle(event, payload)
    else:
        line = _of_service(payload)
    if line is None:
        return None
    clock = clock_time(event.time)
    return Text.assemble((f"{clock} ", "dim"), line)


def _of_run(event: Event, payload: RunPayload) -> Text | None:
    match payload:
        case events.RunCreated(root=run) | events.RunChanged(root=run):
            return _state(run)
        case events.RunMissionChanged(change=change):
            return Text(f"flies plan {change.plan_id} from {change.continue_at} on, changed by {change.actor}")
        case events.RunTakenOver(root=run) | events.RunContinued(root=run):
            return Text(_followed_by(run, continued=isinstance(payload, events.RunContinued)))
        case events.RunTargetMoved() | events.RunTargetNotFollowed() as target:
            return _target(target)
        case events.RunItem(phase=phase, item_id=item_id):
            return Text(f"{'flies to' if phase == 'current' else 'reached'} {item_id}")
        case events.RunCommand() | events.RunAck() as command:
            return _command(command) if isinstance(command, events.RunCommand) else _ack(command)
        case events.RunDrop(root=drop):
            return _drop(drop)
        case events.DropConsentAsked() | events.DropConsentClosed() as consent:
            return _consent(event, consent)
        case events.RunPlanRefused():
            return Text("not started: the vehicle with its current parameters would not fly its plan", style="bold red")
        case events.RunAttachment(root=attachment):
            return Text(f"{attachment.name} was attached to {attachment.plan_item_id} by {attachment.actor}")
        case events.RunPredicted() | events.RunUploadProgress() | events.RunItemEnded():
            return None  # shown by the tables and the bar


def _followed_by(run: Run, *, continued: bool) -> str:
    return f"run {run.continued_by} flies the remaining items" if continued else "another gateway took the run over"


def _target(target: events.RunTargetMoved | events.RunTargetNotFollowed) -> Text:
    if isinstance(target, events.RunTargetNotFollowed):
        return Text(f"{target.waypoint_id} does not follow its target: {describe(target.reason)}", style="bold yellow")
    return Text(f"{target.waypoint_id} follows its target, {target.from_planned_m:.0f} m from the planned point")


def _of_vehicle(event: Event, payload: VehiclePayload) -> Text | None:
    match payload:
        case vehicle.VehicleStatusText(severity=severity, text=text, repeated=repeated, last_age_s=age_s):
            last = "" if age_s is None else f", the last {age_s:.0f} s ago"
            more = f" ({repeated} times more{last})" if repeated else ""
            return Text(f"vehicle reports ({severity.value}): {text}{more}", style="dim")
        case vehicle.VehicleLinkLost() | vehicle.VehicleLinkRestored() | vehicle.VehicleRebooted():
            return Text(event.kind.value.removeprefix("vehicle.").replace("_", " "), style="bold yellow")
        case vehicle.VehicleQuarantined(reason=reason):
            return Text(f"the vehicle is quarantined: {describe(reason)}", style="bold red")
        case vehicle.VehicleQuarantineEnded():
            return Text("the quarantine of the vehicle has ended", style="bold yellow")
        case vehicle.VehicleCommandedInQuarantine(mode=mode):
            return Text(f"{mode.value} was sent although the vehicle is quarantined", style="bold red")
        case vehicle.VehicleLinkSecurity(security=security):
            return Text(f"the vehicle's link is {security.value} now", style="bold yellow")
        case (
            vehicle.VehicleSeen()
            | vehicle.VehicleChanged()
            | vehicle.VehicleParameters()
            | vehicle.VehicleCommand()
            | vehicle.VehicleLinkKey()
            | vehicle.OffboardLease()
            | vehicle.OffboardChanged()
            | vehicle.TasksChanged()
            | vehicle.TasksGripper()
        ):
            return None  # the run's own state covers it


def _of_service(payload: ServicePayload) -> Text | None:
    match payload:
        case service.SimulatorFault() as fault:
            problem = f", not set: {fault.problem}" if fault.problem else ""
            return Text(f"simulated fault {fault.fault} = {fault.value}{problem}", style="bold yellow")
        case (
            service.ServiceStarted()
            | service.ServiceStopped()
            | service.LoopStalled()
            | service.SiteLeaseChanged()
            | service.JournalPruned()
            | service.LinkRefused()
            | service.RequestAccepted()
            | service.WebhookChanged()
            | service.SimulatorSpeedSet()
            | service.PlanCreated()
            | service.JobChanged()
            | service.JobQueueChanged()
        ):
            return None  # of no run


def _state(run: Run) -> Text:
    state = run.state.value
    line = Text.assemble("run is ", (state.replace("_", " "), _STYLES.get(state, "bold")))
    if run.reason:
        line.append(f": {describe(run.reason)}")
    return line


def _command(command: events.RunCommand) -> Text:
    what = " to close the gripper" if command.action == "grab" else ""
    again = "" if command.attempt in {None, 1} else f", try {command.attempt}"
    return Text(f"sends {command.command}{what}{again}")


def _ack(ack: events.RunAck) -> Text:
    if ack.outcome is not events.CommandOutcome.ACKNOWLEDGED:
        why = f": {ack.detail}" if ack.detail else ""
        return Text.assemble(f"{ack.command}: ", (ack.outcome.value.replace("_", " "), "bold"), why)
    progress = f" {ack.progress}%" if ack.result is MavResult.IN_PROGRESS and ack.progress is not None else ""
    result = ack.result.name if ack.result is not None else f"MAV_RESULT {ack.result_code}"
    return Text.assemble(f"ack of {ack.command}: ", (f"{result}{progress}", "bold"))


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
        line.append(f": {describe(drop.reason)}")
    return line


def _consent(event: Event, consent: events.DropConsentAsked | events.DropConsentClosed) -> Text:
    drop = consent.plan_item_id
    if isinstance(consent, events.DropConsentAsked):
        until = clock_time(consent.deadline_at or event.time)
        answer = f"waydrop runs consent {event.run_id} {drop} --question {consent.question} --grant or --refuse"
        return Text(f"drop {drop} requests consent until {until}: {answer}", style="bold magenta")
    actor = f" by {consent.actor}" if consent.actor else ""
    said = consent.comment or describe(consent.reason)
    why = f": {said}" if said else ""
    return Text(f"consent to {drop}: {consent.state.value.replace('_', ' ')}{actor}{why}", style="bold")


def show_comparison(console: Console, comparison: Comparison) -> None:
    """A row for each visit of an item, a line for each drop. Nothing if there is nothing to show."""
    if not comparison.items:
        return
    table = Table(title="predicted against flown", title_justify="left")
    table.add_column("item")
    for name in ("predicted", "flown", "difference"):
        table.add_column(name, justify="right")
    table.add_column("")
    for item in comparison.items:
        table.add_row(*_cells(item))
    whole = _percent(comparison.predicted_s, comparison.flown_s)
    totals = _s(comparison.predicted_s), _s(comparison.flown_s)
    table.add_row("compared items", *totals, whole, _paused(comparison.paused_s), style="bold")
    console.print(table)
    for drop in comparison.drops:
        console.print(_drop_line(drop), markup=False)


def _cells(item: ItemComparison) -> tuple[str, str, str, str, str]:
    name = item.item_id if item.visit == 1 else f"{item.item_id} (visit {item.visit})"
    difference = "" if item.difference_percent is None else f"{item.difference_percent:+.0f} %"
    notes = [
        describe(item.reason) or (f"uncertain by {item.uncertainty_s:.0f} s" if item.uncertainty_s else ""),
        _paused(item.paused_s),
    ]
    return escape(name), _s(item.predicted_s), _s(item.flown_s), difference, escape("; ".join(filter(None, notes)))


def _paused(seconds: float) -> str:
    return f"paused for {seconds:.0f} s, excluded" if seconds >= 0.5 else ""


def _drop_line(drop: DropComparison) -> str:
    line = f"drop {drop.item_id}: "
    line += (
        f"released {drop.distance_m:.1f} m from the predicted position"
        if drop.distance_m is not None
        else describe(drop.reason)
    )
    for word, predicted, flown, unit in (
        ("offset", drop.predicted_offset_m, drop.flown_offset_m, "m"),
        ("speed", drop.predicted_ground_speed_m_s, drop.flown_ground_speed_m_s, "m/s"),
    ):
        if predicted is not None and flown is not None:
            line += f", {word} {predicted:.1f} predicted and {flown:.1f} {unit} flown"
    return line


def _s(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds:.1f} s"


def _percent(predicted_s: float | None, flown_s: float | None) -> str:
    return "" if not predicted_s or flown_s is None else f"{100.0 * (flown_s - predicted_s) / predicted_s:+.0f} %"


class RunView(Protocol):
    """Receives everything about a followed run, in order."""

    def event(self, event: Event) -> None:
        """An event of the run or its vehicle."""

    def note(self, text: str) -> None:
        """Something about the following itself, such as a cut connection."""

    def ended(self, run: Run, assessment: RunAssessment) -> None:
        """The run has ended."""


class TerminalView:
    """For people. Use it as a context: the bar needs the terminal while it runs."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), console=console, transient=True
        )
        self._task: TaskID | None = None
        self._shown: dict[object, object] = {}
        self._flown_to: set[str | None] = set()
        self._seen_current = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._bar.stop()

    def event(self, event: Event) -> None:
        if isinstance(event.data, events.RunUploadProgress):
            self._upload(event.data)
            return
        if self._is_shown(event):
            return
        line = run_line(event)
        if line is not None:
            self._console.print(line)

    def note(self, text: str) -> None:
        self._console.print(f"[yellow]{escape(text)}[/]")

    def ended(self, run: Run, assessment: RunAssessment) -> None:
        self._bar.stop()
        if run.drops:
            self._console.print(drops_table(run))
        for drop in run.last_drops:
            if drop.rests_on_an_ack_alone:
                name = escape(drop.plan_item_id)
                self._console.print(
                    f"[bold yellow]drop {name} rests on an acknowledgement alone[/]: no output movement observed"
                )
        if assessment.achieved:
            self._console.print("[bold green]all drops released, run completed[/]")
        for reason in assessment.reasons:
            self._console.print(f"[bold red]not achieved[/] {escape(reason)}")

    def _is_shown(self, event: Event) -> bool:
        """Whether only fields of a run or drop changed that other events report, or a part of an item was reached."""
        if isinstance(event.data, events.RunItem):
            return self._is_part(event.data)
        state: tuple[object, ...]
        if isinstance(event.data, events.RunChanged):
            about, state = "run", (event.data.root.state, event.data.root.reason)
        elif isinstance(event.data, events.RunDrop):
            drop = event.data.root
            no_output = drop.outcome is DropOutcome.PENDING and drop.output_evidence is OutputEvidence.NOT_ASSIGNED
            about, state = f"drop {drop.plan_item_id}", (drop.phase, drop.outcome, no_output)
        else:
            return False
        before = self._shown.get(about)
        self._shown[about] = state
        return state == before

    def _is_part(self, item: events.RunItem) -> bool:
        """A plan item may be several mission items. PX4 reports some as reached before it flies to the place."""
        if item.phase == "current":
            self._flown_to.add(item.item_id)
            self._seen_current = True
            return False
        is_whole = item.item_id in self._flown_to or not self._seen_current
        self._flown_to.discard(item.item_id)
        return not is_whole

    def _upload(self, step: events.RunUploadProgress) -> None:
        again = "" if step.attempt == 1 else f", attempt {step.attempt}"
        if self._console.is_terminal:
            self._show_bar(step.percent, f"upload {step.mission_type} {step.sent}/{step.total}{again}")
        if step.percent >= 100.0:
            self._console.print(f"uploaded {step.mission_type}, {step.total} items{again}", style="dim")

    def _show_bar(self, percent: float, description: str) -> None:
        if self._task is None:
            self._bar.start()
            self._task = self._bar.add_task("upload", total=100.0)
        self._bar.update(self._task, completed=percent, description=description)
        if percent >= 100.0:
            self._bar.remove_task(self._task)
            self._task = None
            self._bar.stop()


class JsonView:
    """For programs: one JSON document a line on stdout, the last one is the assessment."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        return

    def event(self, event: Event) -> None:
        write_json({"event": event.model_dump(mode="json")}, indent=None)

    def note(self, text: str) -> None:
        write_json({"note": text}, indent=None)

    def ended(self, run: Run, assessment: RunAssessment) -> None:
        document = {"achieved": assessment.achieved, "reasons": assessment.reasons, "run": run.model_dump(mode="json")}
        write_json(document, indent=None)


def drops_table(run: Run) -> Table:
    """Each drop with its outcome and certainty."""
    table = Table(title=f"drops of run {run.id}", title_justify="left")
    for name in ("drop", "outcome", "certainty", "commanded", "acknowledged", "output", "sensed", "offset", "speed"):
        table.add_column(name)
    for drop in run.drops:
        table.add_row(
            escape(drop.plan_item_id),
            drop.outcome.value,
            drop.certainty.value,
            f"{drop.attempts}x" if drop.attempts else "in the mission" if not drop.supervised else "no",
            drop.acknowledged_result.name if drop.acknowledged_result is not None else "no",
            "" if drop.output_evidence is None else drop.output_evidence.value.replace("_", " "),
            "yes" if drop.sensed_at is not None else "no sensor",
            "" if drop.offset_m is None else f"{drop.offset_m:.1f} m",
            "" if drop.ground_speed_m_s is None else f"{drop.ground_speed_m_s:.1f} m/s",
        )
    return table
