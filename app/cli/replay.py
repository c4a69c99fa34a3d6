"""`waydrop replay`: would today's code decide a flight as it was decided? Works on the journal of this machine."""

from __future__ import annotations

import asyncio
import json
from typing import Annotated

import typer

from app.cli.exit_status import ExitStatus
from app.cli.serve import DataDirOption
from app.cli.terminal import count, err, out, show_error, write_json
from app.config import load_settings
from app.domain.errors import NotFoundError, StorageError
from app.domain.flight.recording import Difference, Line, Replay
from app.domain.reason import in_words

RunArgument = Annotated[str, typer.Argument(metavar="RUN", help="The run's id.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Every difference as JSON.")]


def replay(run: RunArgument, data_dir: DataDirOption = None, as_json: JsonOption = False) -> None:
    """Feed a stored run's inputs to this version, and show where it decides otherwise. Nothing is sent or stored."""
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
        out().print(f"at {one.at_s:.1f} s, {one.heard}:", markup=False)
        out().print(f"  then:  {_told(one.recorded)}", markup=False, soft_wrap=True)
        out().print(f"  today: {_told(one.today)}", markup=False, soft_wrap=True)
    verdict = "decided as then" if not found.differences else count(len(found.differences), "difference")
    if found.run is not None:
        why = f": {in_words(found.run.reason)}" if found.run.reason else ""
        err().print(f"today the run is {found.run.state.value}{why}", markup=False)
    err().print(f"{count(found.inputs, 'input')}: {verdict}", markup=False)


def _document(one: Difference) -> dict[str, object]:
    return {"at_s": one.at_s, "input": one.heard, "recorded": one.recorded, "today": one.today}


def _told(effects: list[Line]) -> str:
    return json.dumps(effects) if effects else "nothing"
