"""What `waydrop fly` shows: an upload bar, a line for each event, and at the end a table of the drops."""

from __future__ import annotations

from types import TracebackType
from typing import Protocol, Self

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn
from rich.table import Table

from app.cli.run_lines import run_line
from app.cli.terminal import write_json
from app.cli.verdict import Verdict
from app.domain.drop import DropOutcome, OutputEvidence
from app.domain.events import Event
from app.domain.events.run import RunChanged, RunDrop, RunUploadProgress
from app.domain.run import Run


class RunView(Protocol):
    """Told everything about a followed run, in order."""

    def event(self, event: Event) -> None:
        """An event of the run or its vehicle."""

    def note(self, text: str) -> None:
        """Something about the following itself, such as a cut connection."""

    def ended(self, run: Run, verdict: Verdict) -> None:
        """The run is over."""


class TerminalView:
    """For people. Use it as a context: the bar needs the terminal while it runs."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), console=console, transient=True
        )
        self._task: TaskID | None = None
        self._shown: dict[object, object] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._bar.stop()

    def event(self, event: Event) -> None:
        """See RunView."""
        if isinstance(event.data, RunUploadProgress):
            self._upload(event.data)
            return
        if self._is_shown(event):
            return
        line = run_line(event)
        if line is not None:
            self._console.print(line)

    def note(self, text: str) -> None:
        """See RunView."""
        self._console.print(f"[yellow]{escape(text)}[/]")

    def ended(self, run: Run, verdict: Verdict) -> None:
        """See RunView."""
        self._bar.stop()
        if run.drops:
            self._console.print(drops_table(run))
        for drop in run.last_drops:
            if drop.rests_on_an_ack_alone:
                name = escape(drop.plan_item_id)
                self._console.print(f"[bold yellow]drop {name} rests on an ack alone[/]: no output was seen to move")
        if verdict.achieved:
            self._console.print("[bold green]all drops released, run completed[/]")
        for reason in verdict.reasons:
            self._console.print(f"[bold red]not achieved[/] {escape(reason)}")

    def _is_shown(self, event: Event) -> bool:
        """Whether only such fields of a run or drop changed of which other events tell."""
        state: tuple[object, ...]
        match event.data:
            case RunChanged(root=run):
                about, state = "run", (run.state, run.reason)
            case RunDrop(root=drop):
                no_output = drop.outcome is DropOutcome.PENDING and drop.output_evidence is OutputEvidence.NOT_ASSIGNED
                about, state = f"drop {drop.plan_item_id}", (drop.phase, drop.outcome, no_output)
            case _:
                return False
        before = self._shown.get(about)
        self._shown[about] = state
        return state == before

    def _upload(self, step: RunUploadProgress) -> None:
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
    """For programs: one JSON document a line on stdout, the last one is the verdict."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        return

    def event(self, event: Event) -> None:
        """See RunView."""
        write_json({"event": event.model_dump(mode="json")}, indent=None)

    def note(self, text: str) -> None:
        """See RunView."""
        write_json({"note": text}, indent=None)

    def ended(self, run: Run, verdict: Verdict) -> None:
        """See RunView."""
        document = {"achieved": verdict.achieved, "reasons": verdict.reasons, "run": run.model_dump(mode="json")}
        write_json(document, indent=None)


def drops_table(run: Run) -> Table:
    """Each drop with its outcome and what it rests on."""
    table = Table(title=f"drops of run {run.id}", title_justify="left")
    for name in ("drop", "outcome", "certainty", "commanded", "acknowledged", "output", "sensed", "offset", "speed"):
        table.add_column(name)
    for drop in run.drops:
        table.add_row(
            escape(drop.plan_item_id),
            drop.outcome.value,
            drop.certainty.value,
            f"{drop.attempts}x" if drop.attempts else "in the mission" if not drop.supervised else "no",
            drop.acknowledged_result or "no",
            "" if drop.output_evidence is None else drop.output_evidence.value.replace("_", " "),
            "yes" if drop.sensed_at is not None else "no sensor",
            "" if drop.offset_m is None else f"{drop.offset_m:.1f} m",
            "" if drop.ground_speed_m_s is None else f"{drop.ground_speed_m_s:.1f} m/s",
        )
    return table
