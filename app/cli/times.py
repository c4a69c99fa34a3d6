"""Times as people write and read them: options, which the service knows by other names, and local times."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Final

import typer
from pydantic import AwareDatetime, TypeAdapter, ValidationError

_TIME: Final = TypeAdapter[Any](AwareDatetime)


def time_option(help_text: str) -> Any:
    """An option whose value is as the service reads times."""
    return typer.Option(metavar="TIME", parser=_time, help=help_text)


def _time(text: str) -> str:
    try:
        _TIME.validate_python(text)
    except ValidationError as error:
        example = "2026-05-01T08:00:00Z, or Unix seconds"
        raise typer.BadParameter(f"{text!r} is not a valid time with a UTC offset: use the form {example}") from error
    return text


def date_and_time(seconds: float) -> str:
    """Unix seconds as 2026-05-01 08:00:00, local time."""
    return datetime.fromtimestamp(seconds).strftime("%Y-%m-%d %H:%M:%S")


def clock_time(seconds: float) -> str:
    """Unix seconds as 08:00:00, local time."""
    return datetime.fromtimestamp(seconds).strftime("%H:%M:%S")
