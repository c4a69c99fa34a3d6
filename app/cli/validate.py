"""`waydrop validate`: whether a plan can be flown, and what will happen."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli.plan_report import WindOption, read_plan, show_findings, show_timeline, wind_given, wind_of
from app.cli.service_client import ServerOption, TokenOption, parsed, service_client
from app.cli.terminal import ExitStatus, count, err, out, write_json
from app.domain.plan import Plan, PlanInvalid
from app.domain.prediction import Timeline, WindGiven
from app.domain.rules import checked
from app.domain.validation.finding import Finding, Severity

Checked = tuple[list[Finding], Timeline | None, float | None]
"""Findings, timeline, and the age of the vehicle's parameters in seconds."""


def validate(
    file: Annotated[Path, typer.Argument(help="The plan, a JSON file; - is standard input.")],
    server: ServerOption,
    vehicle: Annotated[
        str | None, typer.Option("--vehicle", help="Check for this vehicle of the running service.")
    ] = None,
    token: TokenOption = None,
    wind: WindOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print findings and timeline as one JSON document.")] = False,
) -> None:
    """Check a plan; show its timeline and every finding with its code.

    Exit status 0: it can be flown. 1: it has errors. 2: the file is no plan. Without --vehicle no service is needed,
    the usual parameters of the plan's vehicle type are assumed, and what depends on them is a warning. Without --wind
    the air is calm.
    """
    given = wind_given(wind)
    try:
        plan = read_plan(file)
    except PlanInvalid as error:
        if as_json:
            write_json({"findings": error.extra["findings"], "timeline": None, "parameters_age_s": None})
            raise typer.Exit(ExitStatus.UNUSABLE) from error
        raise
    findings, timeline, age_s = (
        _check(plan, given) if vehicle is None else asyncio.run(_ask(plan, vehicle, given, server, token))
    )
    if as_json:
        write_json(
            {
                "findings": [finding.model_dump(mode="json") for finding in findings],
                "timeline": None if timeline is None else timeline.model_dump(mode="json"),
                "parameters_age_s": age_s,
            }
        )
    else:
        _show(plan, findings, timeline, for_any=vehicle is None)
        if vehicle is not None:
            age = "of unknown age: the vehicle does not respond" if age_s is None else f"{age_s:g} s old"
            err().print(f"checked against parameters of {vehicle} that are {age}")
    wrong = any(finding.severity is Severity.ERROR for finding in findings)
    raise typer.Exit(ExitStatus.NOT_ACHIEVED if wrong else ExitStatus.OK)


def _check(plan: Plan, given: WindGiven | None) -> Checked:
    found = checked(plan, None, wind_of(given))
    return list(found.findings), found.timeline, None


async def _ask(plan: Plan, vehicle: str, given: WindGiven | None, server: str, token: str | None) -> Checked:
    async with service_client(server, token) as client:
        document = {"plan": plan.model_dump(mode="json"), "vehicle": vehicle}
        if given is not None:
            document["wind"] = given.model_dump(mode="json", exclude_none=True)
        answer: dict[str, Any] = await client.post("/plan-checks", document)
    findings = [parsed(Finding, entry) for entry in answer["findings"]]
    timeline = None if answer["timeline"] is None else parsed(Timeline, answer["timeline"])
    return findings, timeline, answer.get("parameters_age_s")


def _show(plan: Plan, findings: list[Finding], timeline: Timeline | None, *, for_any: bool) -> None:
    if timeline is not None:
        show_timeline(out(), plan, timeline)
    show_findings(out(), findings)
    errors = sum(finding.severity is Severity.ERROR for finding in findings)
    warnings = len(findings) - errors
    err().print(
        f"[bold red]{count(errors, 'error')}[/], {count(warnings, 'warning')}: it would be rejected"
        if errors
        else f"[bold green]it can be flown[/], {count(warnings, 'warning')}"
    )
    depends = sum(bool(finding.assumed) for finding in findings)
    if for_any and depends:
        verb = "depends" if depends == 1 else "depend"
        err().print(f"{count(depends, 'finding')} {verb} on the vehicle: check it with --vehicle")
