"""`waydrop verify-journal` and `waydrop replay`: they work on the journal of this machine."""

from __future__ import annotations

import asyncio
import json
import re
from functools import partial
from typing import Annotated, Final

import typer
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from app.cli.serve import DataDirOption
from app.cli.terminal import ExitStatus, count, err, out, show_error, write_json
from app.config import load_settings
from app.domain.errors import InvalidInputError, NotFoundError, StorageError
from app.domain.events.event import JournalHead
from app.domain.flight.recording import Difference, Line, Replay
from app.domain.reasons import describe

# `waydrop verify-journal`: was anything altered? Works on the journal of this machine, whether Waydrop runs or not.


AnchorOption = Annotated[
    list[str] | None,
    typer.Option(
        "--anchor",
        metavar="SEQ:HASH",
        help="Sequence number and hash of an event that you stored; the journal must contain it. Repeatable.",
    ),
]


def verify_journal(anchor: AnchorOption = None, data_dir: DataDirOption = None) -> None:
    """Verify that no event, plan, run or attachment was altered. Prints SEQ:HASH of the newest event.

    With WAYDROP_POSTGRES_URL, it verifies the store of a cluster, and prints a line for each gateway.
    """
    from app.application import verify

    anchors = [_anchor(text) for text in anchor or []]
    try:
        with Progress(*_COLUMNS, console=err(), transient=True, disable=not err().is_terminal) as bar:
            task = bar.add_task("events")
            progress = partial(_show_progress, bar, task)
            found = asyncio.run(verify(load_settings(data_dir=data_dir), anchors, progress))
    except StorageError as error:  # 1 is kept for a journal that was altered
        show_error(error)
        raise typer.Exit(ExitStatus.UNUSABLE) from error
    for alteration in found.alterations:
        err().print(f"[bold red]altered[/]: {escape(alteration)}")
    for deleted in found.unchecked:
        err().print(f"event {deleted.seq} was deleted by age: its anchor cannot be checked", markup=False)
    for unproven in found.unproven:
        err().print(unproven, markup=False)
    looked_at = [count(found.events, "event"), count(found.plans, "plan"), count(found.runs, "run")]
    looked_at += [count(found.attachments, "attachment")] if found.attachments else []
    result = "as written" if not found.alterations else f"ALTERED: {count(len(found.alterations), 'alteration')}"
    err().print(f"{found.journal}: {', '.join(looked_at)}: {result}", markup=False)
    if found.alterations:
        raise typer.Exit(ExitStatus.NOT_ACHIEVED)
    for gateway, head in sorted(found.heads.items()):
        of = f" {gateway}" if len(found.heads) > 1 else ""
        out().out(f"{head.seq}:{head.hash}{of}", highlight=False)


_COLUMNS: Final = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"), TimeRemainingColumn())


def _show_progress(bar: Progress, task: TaskID, checked: int, total: int) -> None:
    bar.update(task, completed=checked, total=total)


def _anchor(text: str) -> JournalHead:
    match = re.fullmatch(r"([1-9][0-9]{0,15}):([0-9a-fA-F]{64})", text.strip())
    if match is None:
        raise InvalidInputError(
            f"--anchor {text}: not of the form SEQ:HASH",
            hint="as `waydrop verify-journal` prints it, such as 120:3f9a... (64 digits)",
        )
    return JournalHead(seq=int(match[1]), hash=match[2].lower())


RunArgument = Annotated[str, typer.Argument(metavar="RUN", help="The run's id.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print every difference as JSON.")]


def replay(run: RunArgument, data_dir: DataDirOption = None, as_json: JsonOption = False) -> None:
    """Feed the stored inputs of a run to this version and show different decisions. Sends and stores nothing."""
    from app.application import replayed

    try:
        found = asyncio.run(replayed(load_settings(data_dir=data_dir), run))
    except (StorageError, NotFoundError) as error:  # 1 is kept for a difference
        show_error(error)
        raise typer.Exit(ExitStatus.UNUSABLE) from error
    if as_json:
        write_json({"inputs": found.inputs, "differences": [_document(one) for one in found.differences]})
    else:
        _show(found)
    if found.differences:
        raise typer.Exit(ExitStatus.NOT_ACHIEVED)


def _show(found: Replay) -> None:
    for one in found.differences:
        out().print(f"at {one.at_s:.1f} s, {one.input}:", markup=False)
        out().print(f"  then:  {_json_of(one.recorded)}", markup=False, soft_wrap=True)
        out().print(f"  today: {_json_of(one.today)}", markup=False, soft_wrap=True)
    result = "decided as then" if not found.differences else count(len(found.differences), "difference")
    if found.run is not None:
        why = f": {describe(found.run.reason)}" if found.run.reason else ""
        err().print(f"today the run is {found.run.state.value}{why}", markup=False)
    err().print(f"{count(found.inputs, 'input')}: {result}", markup=False)


def _document(one: Difference) -> dict[str, object]:
    return {"at_s": one.at_s, "input": one.input, "recorded": one.recorded, "today": one.today}


def _json_of(effects: list[Line]) -> str:
    return json.dumps(effects) if effects else "nothing"
