"""Where commands write: results to stdout, everything about them to stderr."""

from __future__ import annotations

import json
import os
import shutil
import sys
from contextlib import suppress
from enum import IntEnum
from typing import Any, Final, TextIO, cast

from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderHook, RenderResult
from rich.control import Control
from rich.markup import escape

from app.domain.errors import WaydropError
from app.domain.text import escaped, lines


class ExitStatus(IntEnum):
    """Documented in docs/reference/command-line.md; scripts decide by these."""

    OK = 0
    NOT_ACHIEVED = 1
    """The plan has errors, a drop was not released, the run did not complete, or the service could not start."""
    UNUSABLE = 2
    """The file, an option or a setting cannot be used. Nothing was asked of a vehicle."""
    UNREACHABLE = 3
    """No Waydrop answers at the server's address, or it stayed away while a run was followed."""
    REFUSED = 4
    """Waydrop answered with a refusal: no access, not found, busy, wrong state."""
    OUTPUT_FAILED = 5
    """Standard output cannot be written: a full disk, a closed pipe. What was asked for may have been done."""
    INTERRUPTED = 130
    """Ctrl-C. A flight that is only followed continues."""
    TERMINATED = 143
    """SIGTERM, likewise."""


_BY_CODE: Final = {
    "settings.invalid": ExitStatus.UNUSABLE,
    "link_key.invalid": ExitStatus.UNUSABLE,
    "plan.invalid": ExitStatus.UNUSABLE,
    "input.invalid": ExitStatus.UNUSABLE,
    "conversion.refused": ExitStatus.UNUSABLE,
    "plan.rejected": ExitStatus.NOT_ACHIEVED,
    "drop.consent_not_asked": ExitStatus.REFUSED,
    "server.unreachable": ExitStatus.UNREACHABLE,
    "server.answer_lost": ExitStatus.UNREACHABLE,
    "output.failed": ExitStatus.OUTPUT_FAILED,
    "storage.failed": ExitStatus.NOT_ACHIEVED,
}


class ServerUnreachableError(WaydropError, code="server.unreachable"):
    """No Waydrop answers at this address."""


class AnswerLostError(WaydropError, code="server.answer_lost"):
    """The request was sent, and no answer came: it may have been carried out."""


class OutputError(WaydropError, code="output.failed"):
    """Standard output cannot be written."""


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
_NARROW: Final = 72
"""A narrower table shows no values; a terminal wraps the lines of a wider one."""


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


class Output:
    """Standard output, whose errors are OutputErrors: others would be taken for defects, or end with status 1."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._failure: OSError | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> None:
        """Fails again once it failed: click asks by a write what the stream takes, and forgets the error."""
        try:
            if self._failure is not None:
                raise self._failure
            self._stream.write(text)
        except OSError as error:
            self._failure = error
            self._failed(error)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            self._failed(error)

    def _failed(self, error: OSError) -> None:
        """Nothing more is written to it: Python would try again at its end."""
        with suppress(OSError), open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), self._stream.fileno())
        raise OutputError(
            f"standard output cannot be written: {error.strerror or error}",
            hint="what the command asked for may have been done",
        ) from error


class _ErrorOutput(Output):
    """Standard error. What is said about a result and cannot be written is no failure of the command."""

    def _failed(self, error: OSError) -> None:
        pass


def out() -> Console:
    """Standard output, made anew so that a redirected stdout is honoured.

    Raises:
        OutputError: it is closed. The console raises it, too.
    """
    if sys.stdout is None:
        raise OutputError("standard output is closed", hint="redirect it to a file or to /dev/null")
    return _console(Output(sys.stdout), is_error=False)


def err() -> Console:
    """Standard error."""
    return _console(_ErrorOutput(sys.stderr or open(os.devnull, "w")), is_error=True)


def _console(stream: Output, *, is_error: bool) -> Console:
    file = cast("TextIO", stream)
    console = Console(file=file, stderr=is_error, highlight=False, emoji=False, soft_wrap=True, width=_width(file))
    console.push_render_hook(_ShownOnly())
    return console


def count(number: int, thing: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _width(stream: TextIO) -> int | None:
    """A file or a pipe has no width: nothing is cut there. COLUMNS counts everywhere."""
    if not stream.isatty() and "COLUMNS" not in os.environ:
        return _WIDE
    return max(_NARROW, shutil.get_terminal_size().columns)


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
