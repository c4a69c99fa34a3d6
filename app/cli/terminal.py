"""Where commands write: results to stdout, everything about them to stderr."""

from __future__ import annotations

import json
from typing import Any

from rich.console import Console
from rich.markup import escape

from app.domain.errors import WaydropError


def out() -> Console:
    """Standard output, made anew so that a redirected stdout is honoured."""
    return Console(highlight=False, soft_wrap=True)


def err() -> Console:
    """Standard error."""
    return Console(stderr=True, highlight=False, soft_wrap=True)


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
