"""Where commands write: results to stdout, everything about them to stderr."""

from __future__ import annotations

import json
import os
import sys
from typing import Any, Final, TextIO

from rich.console import Console
from rich.markup import escape

from app.domain.errors import WaydropError

_WIDE: Final = 200


def out() -> Console:
    """Standard output, made anew so that a redirected stdout is honoured."""
    return Console(highlight=False, emoji=False, soft_wrap=True, width=_width(sys.stdout))


def err() -> Console:
    """Standard error."""
    return Console(stderr=True, highlight=False, emoji=False, soft_wrap=True, width=_width(sys.stderr))


def count(number: int, thing: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _width(stream: TextIO) -> int | None:
    """A file or a pipe has no width: nothing is cut there. COLUMNS counts everywhere."""
    return None if stream.isatty() or "COLUMNS" in os.environ else _WIDE


def write_json(document: Any, *, indent: int | None = 2) -> None:
    """One JSON document to stdout, without colour."""
    out().out(json.dumps(document, indent=indent, ensure_ascii=False), highlight=False)


def show_error(error: WaydropError) -> None:
    """An expected error in words: what, its code, how to mend it."""
    console = err()
    console.print(f"[bold red]error[/] [dim]{escape(error.code)}[/]")
    for line in error.detail.splitlines():
        console.print(f"  {escape(line)}")
    if error.hint:
        console.print(f"  [green]→[/] {escape(error.hint)}")
