"""Reads the plan file that a command is given."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

from app.domain.errors import InvalidInputError
from app.domain.plan import Plan, parse_plan

MAX_BYTES: Final = 64 * 1024 * 1024


class PlanFileError(InvalidInputError):
    """The file cannot be read."""

    code = "input.invalid"


def read_plan(path: Path) -> Plan:
    """The plan in a file, or on standard input if the path is `-`.

    Raises:
        PlanFileError: it cannot be read; PlanInvalid: it is not a plan, with all findings.
    """
    return parse_plan(read_file(path))


def read_file(path: Path) -> bytes:
    """The bytes of a file, or of standard input if the path is `-`. Raises PlanFileError."""
    try:
        if str(path) == "-":
            return sys.stdin.buffer.read(MAX_BYTES + 1)
        with path.open("rb") as file:
            return file.read(MAX_BYTES + 1)
    except OSError as error:
        raise PlanFileError(f"{path}: {error.strerror or error}", hint="name a file that holds a plan") from error
