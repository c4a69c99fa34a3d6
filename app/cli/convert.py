"""`waydrop convert`: plans from and to the formats of other software."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final

import typer
from rich.markup import escape

from app.cli.plan_report import PlanFileError, read_file
from app.cli.terminal import err, out
from app.domain.plan import Plan
from app.domain.vehicle.state import VehicleType
from app.interchange.findings import ConversionFinding, FindingKind
from app.interchange.formats import TargetFormat, convert_to_plan, export_plan

_STYLES: Final = {FindingKind.LOST: "bold red", FindingKind.ASSUMED: "bold yellow", FindingKind.KEPT: "bold cyan"}
_LONGEST_NAME: Final = 200


class Target(StrEnum):
    """The output formats."""

    PLAN = "plan"
    QGC = "qgc"
    GEOJSON = "geojson"
    KML = "kml"


def convert(
    file: Annotated[
        Path, typer.Argument(help="A plan, a QGroundControl .plan or a QGC WPL waypoint file; - is standard input.")
    ],
    to: Annotated[Target, typer.Option("--to", help="The format to write.")],
    output: Annotated[Path | None, typer.Option("--output", help="Write to this file instead of stdout.")] = None,
    name: Annotated[str | None, typer.Option("--name", help="Name of the plan, if the file has none.")] = None,
    vehicle_type: Annotated[
        VehicleType | None, typer.Option("--vehicle-type", help="Vehicle type, if the file has none.")
    ] = None,
) -> None:
    """Convert a plan. The input format is detected; each loss and assumption is printed to stderr.

    Exit status 0: converted. 2: the file cannot become a plan, or cannot be read or written.
    """
    _refuse_the_source(file, output)
    conversion = convert_to_plan(read_file(file), name=name or _name_of(file), vehicle_type=vehicle_type)
    findings = list(conversion.findings)
    if to is Target.PLAN:
        text = _plan_text(conversion.plan)
    else:
        exported = export_plan(conversion.plan, TargetFormat(to.value))
        text = exported.text
        findings += exported.findings
    _show(findings)
    _write(text, output)


def _refuse_the_source(file: Path, output: Path | None) -> None:
    """A conversion may lose information: it must not overwrite its source."""
    if output is not None and str(file) != "-" and output.exists() and file.exists() and output.samefile(file):
        raise PlanFileError(f"{output} is the input file", hint="use another file for --output")


def _name_of(file: Path) -> str | None:
    """Return a plan name from the file name, whatever bytes it has."""
    return None if str(file) == "-" else file.stem.encode("utf-8", "replace").decode()[:_LONGEST_NAME]


def _plan_text(plan: Plan) -> str:
    """Only explicit fields: defaults are omitted."""
    document = plan.model_dump(mode="json", exclude_defaults=True)
    document["items"] = [{"id": item["id"], "type": item["type"], **item} for item in document["items"]]
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _show(findings: list[ConversionFinding]) -> None:
    console = err()
    for finding in findings:
        style = _STYLES[finding.kind]
        place = escape(finding.pointer or "/")
        console.print(f"[{style}]{finding.kind.value}[/] [bold]{escape(finding.code)}[/] at {place}")
        console.print(f"  {escape(finding.message)}")
        if finding.hint:
            console.print(f"  [green]→[/] {escape(finding.hint)}")
    counts = ", ".join(f"{sum(finding.kind is kind for finding in findings)} {kind}" for kind in FindingKind)
    console.print(f"[bold green]converted[/]: {counts}")


def _write(text: str, output: Path | None) -> None:
    if output is None:
        out().out(text, highlight=False, end="")
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise PlanFileError(f"{output}: {error.strerror or error}", hint="use a writable file") from error
