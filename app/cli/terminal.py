"""Where commands write: results to stdout, everything about them to stderr."""

from __future__ import annotations

import json
import os
import sys
from enum import IntEnum
from typing import Any, Final, TextIO

from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderHook, RenderResult
from rich.control import Control
from rich.markup import escape

from app.domain.errors import WaydropError
from app.domain.text import escaped, lines


class ExitStatus(IntEnum):
    """Documented in docs/how-to/deploy.md; scripts decide by these."""

    OK = 0
    NOT_ACHIEVED = 1
    """The plan has errors, a drop was not released, the run did not complete, or the service could not start."""
    UNUSABLE = 2
    """The file, an option or a setting cannot be used. Nothing was asked of a vehicle."""
    UNREACHABLE = 3
    """No Waydrop answers at the server's address, or it stayed away while a run was followed."""
    REFUSED = 4
    """Waydrop answered with a refusal: no access, not found, busy, wrong state."""
    INTERRUPTED = 130
    """Ctrl-C. A flight that is only followed continues."""


_BY_CODE: Final = {
    "settings.invalid": ExitStatus.UNUSABLE,
    "link_key.invalid": ExitStatus.UNUSABLE,
    "plan.invalid": ExitStatus.UNUSABLE,
    "input.invalid": ExitStatus.UNUSABLE,
    "conversion.refused": ExitStatus.UNUSABLE,
    "plan.rejected": ExitStatus.NOT_ACHIEVED,
    "drop.consent_not_asked": ExitStatus.REFUSED,
    "server.unreachable": ExitStatus.UNREACHABLE,
    "storage.failed": ExitStatus.NOT_ACHIEVED,
}


class ServerUnreachableError(WaydropError, code="server.unreachable"):
    """No Waydrop answers at this address."""


class ServerRefusedError(WaydropError):
    """Waydrop answered with problem+json. `code` is the problem's; `status` its HTTP status."""

    def __init__(self, code: str, detail: str, *, status: int, hint: str = "", **extra: object) -> None:
        super().__init__(detail, hint=hint, **extra)
        self.code = code
        self.status = status


def status_of(error: WaydropError) -> ExitStatus:
    """The exit status that an error ends a command with."""
    known = _BY_CODE.get(error.code)
    if known is not None:
        return known
    return ExitStatus.REFUSED if isinstance(error, ServerRefusedError) else ExitStatus.NOT_ACHIEVED


_WIDE: Final = 200


class _Shown:
    """What is written, without what vehicles and users may have put into texts to steer the terminal."""

    def __init__(self, renderable: ConsoleRenderable) -> None:
        self._renderable = renderable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for segment in console.render(self._renderable, options):
            yield segment if segment.control else segment._replace(text=lines(segment.text))


class _ShownOnly(RenderHook):
    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        return [one if isinstance(one, Control) else _Shown(one) for one in renderables]


def out() -> Console:
    """Standard output, made anew so that a redirected stdout is honoured."""
    return _console(sys.stdout)


def err() -> Console:
    """Standard error."""
    return _console(sys.stderr)


def _console(stream: TextIO) -> Console:
    is_error = stream is sys.stderr
    console = Console(stderr=is_error, highlight=False, emoji=False, soft_wrap=True, width=_width(stream))
    console.push_render_hook(_ShownOnly())
    return console


def count(number: int, thing: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _width(stream: TextIO) -> int | None:
    """A file or a pipe has no width: nothing is cut there. COLUMNS counts everywhere."""
    return None if stream.isatty() or "COLUMNS" in os.environ else _WIDE


def write_json(document: Any, *, indent: int | None = 2) -> None:
    """One JSON document to stdout, without colour. What cannot be seen is escaped."""
    text = json.dumps(document, indent=indent, ensure_ascii=False)
    out().out(escaped(text), highlight=False)


def show_error(error: WaydropError) -> None:
    """Print an expected error: what, its code, how to fix it."""
    console = err()
    console.print(f"[bold red]error[/] [dim]{escape(error.code)}[/]")
    for line in error.detail.splitlines():
        console.print(f"  {escape(line)}")
    if error.hint:
        console.print(f"  [green]→[/] {escape(error.hint)}")
