"""The wind on the command line: `270/5` is 5 m/s from the west, as weather reports write it."""

from __future__ import annotations

import re
from typing import Annotated

import typer
from pydantic import ValidationError

from app.domain.prediction import CALM, Wind, WindGiven

_WIND = re.compile(r"(\d{1,3}(?:\.\d+)?)/(\d{1,2}(?:\.\d+)?)")

WindOption = Annotated[
    str | None,
    typer.Option("--wind", metavar="FROM/SPEED", help="Degrees it comes from and m/s: 270/5 is a westerly of 5 m/s."),
]


def wind_given(text: str | None) -> WindGiven | None:
    """What the service is told; None if nothing was given. Raises typer.BadParameter."""
    if text is None:
        return None
    match = _WIND.fullmatch(text)
    if match is None:
        raise typer.BadParameter(f"{text!r} is no wind: write FROM/SPEED, such as 270/5", param_hint="--wind")
    try:
        return WindGiven(from_deg=float(match[1]), speed_m_s=float(match[2]))
    except ValidationError as error:
        raise typer.BadParameter("0 to 360 degrees and 0 to 75 m/s", param_hint="--wind") from error


def wind_of(given: WindGiven | None) -> Wind:
    """The wind itself; calm air if nothing was given."""
    return CALM if given is None else given.wind()
