"""`waydrop verify-journal`: was anything altered? Works on the journal of this machine, whether Waydrop runs or not."""

from __future__ import annotations

import asyncio
import re
from typing import Annotated

import typer
from rich.markup import escape

from app.cli.exit_status import ExitStatus
from app.cli.serve import DataDirOption
from app.cli.terminal import count, err, out, show_error
from app.config import load_settings
from app.domain.errors import InvalidInputError, StorageError
from app.domain.journal_chain import JournalHead

AnchorOption = Annotated[
    list[str] | None,
    typer.Option(
        "--anchor",
        metavar="SEQ:HASH",
        help="An event's seq and hash that you kept; the journal must have it. Repeatable.",
    ),
]


def verify_journal(anchor: AnchorOption = None, data_dir: DataDirOption = None) -> None:
    """Prove that no event, plan, run or attachment was altered. Prints SEQ:HASH of its newest event: keep it."""
    from app.application import verify

    anchors = [_anchor(text) for text in anchor or []]
    try:
        found = asyncio.run(verify(load_settings(data_dir=data_dir), anchors))
    except StorageError as error:  # 1 is kept for a journal that was altered
        show_error(error)
        raise typer.Exit(ExitStatus.UNUSABLE) from error
    for alteration in found.alterations:
        err().print(f"[bold red]altered[/]: {escape(alteration)}")
    looked_at = [count(found.head.seq, "event"), count(found.plans, "plan"), count(found.runs, "run")]
    looked_at += [count(found.attachments, "attachment")] if found.attachments else []
    verdict = (
        "as written" if not found.alterations else f"NOT as written: {count(len(found.alterations), 'alteration')}"
    )
    err().print(f"{found.gateway}: {', '.join(looked_at)}: {verdict}", markup=False)
    if found.alterations:
        raise typer.Exit(ExitStatus.NOT_ACHIEVED)
    out().out(f"{found.head.seq}:{found.head.hash}", highlight=False)


def _anchor(text: str) -> JournalHead:
    match = re.fullmatch(r"([1-9][0-9]{0,15}):([0-9a-fA-F]{64})", text.strip())
    if match is None:
        raise InvalidInputError(
            f"--anchor {text}: not SEQ:HASH",
            hint="as `waydrop verify-journal` prints it, such as 120:3f9a... (64 digits)",
        )
    return JournalHead(seq=int(match[1]), hash=match[2].lower())
