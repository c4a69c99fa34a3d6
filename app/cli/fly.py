"""`waydrop fly`: have a plan flown by a vehicle and follow it until every drop has an outcome."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from app.cli.event_stream import EventStream
from app.cli.exit_status import ExitStatus
from app.cli.plan_file import read_plan
from app.cli.run_following import RunFollower
from app.cli.run_view import JsonView, RunView, TerminalView
from app.cli.service_client import ServerOption, TokenOption, service_client
from app.cli.terminal import err, out
from app.cli.verdict import STRICT, verdict
from app.cli.wind_option import WindOption, wind_given
from app.domain.drop import Certainty
from app.domain.plan import Plan
from app.domain.prediction import WindGiven


def fly(
    file: Annotated[Path, typer.Argument(help="The plan, a JSON file; - is standard input.")],
    vehicle: Annotated[str, typer.Option("--vehicle", help="Which vehicle; `waydrop vehicles` lists them.")],
    server: ServerOption,
    token: TokenOption = None,
    wind: WindOption = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="An inferred release is not enough: short for --certainty acknowledged.")
    ] = False,
    certainty: Annotated[
        Certainty, typer.Option(help="The weakest certainty of a release that counts as achieved.")
    ] = Certainty.INFERRED,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document a line instead of text.")] = False,
) -> None:
    """Fly a plan and follow it. Exit status 0 only if every drop was released and the run completed.

    Ctrl-C stops following: the flight goes on.
    """
    given = wind_given(wind)
    plan = read_plan(file)
    least = STRICT if strict and certainty is Certainty.INFERRED else certainty
    view: JsonView | TerminalView = JsonView() if as_json else TerminalView(out())
    with view:
        raise typer.Exit(asyncio.run(fly_and_follow(plan, vehicle, server, token, least, view, given)))


async def fly_and_follow(
    plan: Plan,
    vehicle_id: str,
    server: str,
    token: str | None,
    least: Certainty,
    view: RunView,
    wind: WindGiven | None = None,
) -> ExitStatus:
    """Post the plan, start the run, tell `view` everything, and judge the end. Cancelling leaves the flight alone."""
    async with service_client(server, token) as client:
        stored = await client.post("/plans", plan.model_dump(mode="json"))
        follower = RunFollower(client, EventStream(client), view)
        try:
            run = await follower.start(str(stored["id"]), vehicle_id, wind)
            view.note(f"run {run.id}: plan {plan.name} ({stored['id']}) with vehicle {vehicle_id}")
            run = await follower.follow()
        except asyncio.CancelledError:
            _tell_left(follower.run.id if follower.run else None)
            raise
        judged = verdict(run, least=least)
        view.ended(run, judged)
        return ExitStatus.OK if judged.achieved else ExitStatus.NOT_ACHIEVED


def _tell_left(run_id: str | None) -> None:
    if run_id is None:
        err().print("\n[yellow]interrupted while the run was asked for:[/] `waydrop runs` tells whether it exists")
        return
    name = escape(run_id)
    err().print(
        f"\n[yellow]stopped following; the flight goes on.[/] See it with `waydrop runs show {name}`, "
        f"bring it home with `waydrop runs return {name}`"
    )
