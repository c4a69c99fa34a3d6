"""Findings and timeline of a plan as text."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Final

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from app.domain.errors import InvalidInputError, WaydropError
from app.domain.plan import Plan, parse_plan
from app.domain.prediction import CALM, PredictedAlternate, PredictedDrop, Timeline, Wind, WindGiven
from app.domain.validation.finding import Finding, Severity

MAX_BYTES: Final = 64 * 1024 * 1024


class PlanFileError(InvalidInputError, code="input.invalid"):
    """The file cannot be read."""


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
            if sys.stdin is None:
                raise PlanFileError("standard input is closed", hint="name a file, or send the plan to the command")
            return sys.stdin.buffer.read(MAX_BYTES + 1)
        with path.open("rb") as file:
            return file.read(MAX_BYTES + 1)
    except OSError as error:
        raise PlanFileError(f"{path}: {error.strerror or error}", hint="use a file that contains a plan") from error


_WIND = re.compile(r"(\d{1,3}(?:\.\d+)?)/(\d{1,2}(?:\.\d+)?)")

WindOption = Annotated[
    str | None,
    typer.Option(
        "--wind",
        metavar="FROM/SPEED",
        help="Direction in degrees that the wind comes from, and m/s: 270/5 is a west wind of 5 m/s.",
    ),
]


def wind_given(text: str | None) -> WindGiven | None:
    """The wind for the request; None without one. Raises typer.BadParameter."""
    if text is None:
        return None
    match = _WIND.fullmatch(text)
    if match is None:
        raise typer.BadParameter(f"{text!r} is not a valid wind: use FROM/SPEED, such as 270/5", param_hint="--wind")
    try:
        return WindGiven(from_deg=float(match[1]), speed_m_s=float(match[2]))
    except ValidationError as error:
        raise typer.BadParameter("0 to 360 degrees and 0 to 75 m/s", param_hint="--wind") from error


def wind_of(given: WindGiven | None) -> Wind:
    """The wind; calm air without one."""
    return CALM if given is None else given.wind()


MOST_NAMED = 3
"""Assumed facts that are shown of a finding."""
_STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow"}


def show_findings(console: Console, findings: Iterable[Finding]) -> None:
    """Errors first; each with its place, its rule code, the message and the hint."""
    ordered = sorted(findings, key=lambda finding: finding.severity is not Severity.ERROR)
    for finding in ordered:
        style = _STYLES[finding.severity]
        place = finding.pointer or "/"
        item = f" ({finding.item_id})" if finding.item_id else ""
        console.print(f"[{style}]{finding.severity.value}[/] [bold]{escape(finding.code)}[/] at {escape(place + item)}")
        console.print(f"  {escape(finding.message)}")
        if finding.assumed:
            console.print(f"  [dim]assumed: {escape(_assumed(finding))}[/]")
        if finding.hint:
            console.print(f"  [green]→[/] {escape(finding.hint)}")


def _assumed(finding: Finding) -> str:
    more = len(finding.assumed) - MOST_NAMED
    return ", ".join(finding.assumed[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def findings_of(error: WaydropError) -> list[Finding]:
    """The findings that an error carries: ours as they are, a server's from its problem document."""
    carried = error.extra.get("findings")
    return [Finding.model_validate(entry) for entry in carried] if isinstance(carried, list) else []


def show_timeline(console: Console, plan: Plan, timeline: Timeline) -> None:
    """What is predicted: a row for each visit of an item, then a line for each drop."""
    table = Table(title=f"{escape(plan.name)} ({plan.vehicle_type.value})", title_justify="left")
    table.add_column("at", justify="right")
    table.add_column("item")
    table.add_column("type")
    has_battery = timeline.battery_used_percent is not None
    for name in ("takes", "distance", "speed", "altitude", *(("battery",) if has_battery else ())):
        table.add_column(name, justify="right")
    table.add_column("")
    for entry in timeline.entries:
        table.add_row(
            _clock(entry.start_s),
            entry.item_id if entry.visit == 1 else f"{entry.item_id} (visit {entry.visit})",
            entry.type.replace("_", " "),
            f"{entry.duration_s:.0f} s",
            f"{entry.distance_m:.0f} m" if entry.distance_m >= 0.5 else "",
            f"{entry.ground_speed_m_s:.1f} m/s" if entry.ground_speed_m_s else "",
            f"{entry.relative_altitude_m:.0f} m",
            *((f"{entry.battery_used_percent or 0.0:.1f} %",) if has_battery else ()),
            "stops" if entry.brakes else "",
        )
    console.print(table)
    for drop in timeline.drops:
        console.print(_drop_line(drop), markup=False)
    for alternate in timeline.alternates:
        console.print(_alternate_line(alternate), markup=False)
    end = "without a defined end" if timeline.open_ended else f"{_clock(timeline.duration_s)} min"
    if timeline.truncated:
        end = f"more than {end}: only the first {len(timeline.entries)} visits are predicted"
    calm = "" if timeline.wind.given else ", in calm air"
    console.print(f"{timeline.distance_m / 1000:.2f} km, {end}{calm}{_battery_words(timeline)}", markup=False)


def _drop_line(drop: PredictedDrop) -> str:
    how = "supervised" if drop.supervised else "embedded"
    line = f"drop {drop.item_id} at {_clock(drop.at_s)}: {how}, {drop.release_motion}"
    if drop.release_motion == "moving":
        line += f" at {drop.ground_speed_m_s:.1f} m/s, about {drop.lead_m:.0f} m before the point"
    else:
        line += f", within {drop.offset_m:.1f} m of the point"
    if drop.throw_m >= 1.0:
        line += f", the parcel lands {drop.throw_m:.0f} m on, after {drop.fall_s:.1f} s"
    return line


def _alternate_line(alternate: PredictedAlternate) -> str:
    way = f"{alternate.distance_m:.0f} m, {alternate.duration_s:.0f} s"
    return f"if {alternate.drop_id} fails: to {alternate.item_id}, {way} with its drop"


def _battery_words(timeline: Timeline) -> str:
    used = timeline.battery_used_percent
    if used is None:
        return ""
    start = timeline.battery_start_percent
    return f", {used:.0f} % of the battery, which has {'no known charge' if start is None else f'{start:.0f} %'}"


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
