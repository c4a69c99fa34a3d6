"""`waydrop runs`: list runs, show one, act on one."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from rich.table import Table

from app.cli.run_changes import answer_consent, change_mission, consent_line, continue_run, insert_items
from app.cli.run_view import drops_table, show_comparison
from app.cli.service_client import Query, ServerOption, ServiceClient, TokenOption, parsed, with_client
from app.cli.terminal import err, out, write_json
from app.cli.times import date_and_time, time_option
from app.domain.delivery.comparison import Comparison
from app.domain.errors import InvalidInputError
from app.domain.reasons import describe
from app.domain.run.run import Run, RunState

JsonOption = Annotated[bool, typer.Option("--json", help="Print the response of the service as JSON.")]
RunArgument = Annotated[str, typer.Argument(metavar="RUN", help="The run's id.")]

runs_app = typer.Typer(help="List runs; show or control one.", invoke_without_command=True)


@runs_app.callback()
def list_runs(
    context: typer.Context,
    server: ServerOption,
    token: TokenOption = None,
    limit: Annotated[int, typer.Option(min=1, max=500, help="Maximum number of results, newest first.")] = 20,
    as_json: JsonOption = False,
) -> None:
    """List the newest runs; the sub-commands show one or act on one."""
    if context.invoked_subcommand is not None:
        return
    answer = with_client(server, token, lambda client: client.get("/runs", limit=limit))
    if as_json:
        write_json(answer)
    elif not answer["runs"]:
        err().print("no runs yet")
    else:
        out().print(runs_table([parsed(Run, row) for row in answer["runs"]]))


@runs_app.command()
def show(run: RunArgument, server: ServerOption, token: TokenOption = None, as_json: JsonOption = False) -> None:
    """Show one run with the evidence of its drops, and its predicted duration."""
    if as_json:
        write_json(with_client(server, token, lambda client: client.get(f"/runs/{run}")))
        return

    async def both(client: ServiceClient) -> tuple[Any, Any]:
        return await client.get(f"/runs/{run}"), await client.get(f"/runs/{run}/comparison")

    answer, comparison = with_client(server, token, both)
    _show(parsed(Run, answer))
    show_comparison(out(), parsed(Comparison, comparison))


@runs_app.command()
def compare(run: RunArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Predicted against flown as JSON: each item's time, each drop's release."""
    write_json(with_client(server, token, lambda client: client.get(f"/runs/{run}/comparison")))


@runs_app.command()
def report(
    run: RunArgument,
    server: ServerOption,
    token: TokenOption = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the report (HTML) to this file.")] = None,
) -> None:
    """Delivery report: JSON to stdout, or the sheet to print to a file."""
    if output is None:
        write_json(with_client(server, token, lambda client: client.get(f"/runs/{run}/delivery-report")))
        return
    sheet = with_client(server, token, lambda client: client.text(f"/runs/{run}/delivery-report.html"))
    try:
        output.write_text(sheet, encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(f"{output} cannot be written: {error.strerror}", hint="name another file") from error
    err().print(f"wrote the delivery report of {run} to {output}", markup=False)


def _acting(action: str, help_text: str) -> None:
    def act(run: RunArgument, server: ServerOption, token: TokenOption = None) -> None:
        _show(parsed(Run, with_client(server, token, lambda client: client.post(f"/runs/{run}/{action}"))))

    runs_app.command(action, help=help_text)(act)


_acting("start", "Start a run whose mission is uploaded.")
_acting("pause", "Hold position.")
_acting("resume", "Resume after a pause.")
_acting("return", "Return to launch; the remaining drops are not made.")
_acting("divert", "Divert to the rally point that a return would choose; rejected if it would choose none.")
_acting("land", "Land at the current position.")
_acting("abort", "On the ground: end the run. In flight: return to launch, which ends it.")
runs_app.command("consent")(answer_consent)
runs_app.command("change")(change_mission)
runs_app.command("insert")(insert_items)
runs_app.command("continue")(continue_run)


def _show(run: Run) -> None:
    console = out()
    console.print(runs_table([run]))
    if run.reason:
        console.print(f"reason: {describe(run.reason)}", markup=False)
    if run.rally is not None:
        place = f"{run.rally.latitude_deg:.6f} {run.rally.longitude_deg:.6f}"
        console.print(f"returns to {describe(run.rally.reason)} ({place})", markup=False)
    if run.drops:
        console.print(drops_table(run))
    for drop in run.drops:
        if (line := consent_line(drop)) is not None:
            console.print(line, markup=False)


def runs_table(rows: list[Run]) -> Table:
    table = Table()
    for name in ("run", "state", "vehicle", "item", "drops", "created"):
        table.add_column(name, no_wrap=name == "run", min_width=len(rows[0].id) if name == "run" else None)
    for run in rows:
        table.add_row(
            run.id,
            run.state.value.replace("_", " "),
            run.vehicle_id,
            run.item_id or "",
            ", ".join(f"{drop.plan_item_id} {drop.outcome.value}" for drop in run.drops),
            date_and_time(run.created_at),
        )
    return table


PAGE: Final = 200


@runs_app.command("list")
def list_filtered(
    server: ServerOption,
    token: TokenOption = None,
    state: Annotated[list[RunState] | None, typer.Option(help="Runs in this state; repeatable.")] = None,
    vehicle: Annotated[str | None, typer.Option(metavar="ID", help="Runs of this vehicle.")] = None,
    plan: Annotated[str | None, typer.Option(metavar="ID", help="Runs of this plan.")] = None,
    open_only: Annotated[bool, typer.Option("--open", help="Only runs that have not ended.")] = False,
    since: Annotated[
        str | None, time_option("Created since this time, such as 2026-05-01T00:00:00Z, or Unix seconds.")
    ] = None,
    until: Annotated[str | None, time_option("Created before this time.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Maximum number of results, newest first.")] = 20,
    as_json: JsonOption = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="A table for spreadsheets.")] = False,
) -> None:
    """List the matching runs, newest first."""
    wanted: dict[str, Query] = {"vehicle": vehicle, "plan": plan, "created_from": since, "created_before": until}
    wanted |= {"open": "true" if open_only else None, "state": ",".join(state) if state else None}
    if as_csv:
        with_client(server, token, lambda client: _write_csv(client, wanted, limit))
        return
    rows = with_client(server, token, lambda client: client.pages("/runs", "runs", "older_than", PAGE, limit, **wanted))
    if as_json:
        write_json({"runs": rows})
    elif not rows:
        err().print("no such runs")
    else:
        out().print(runs_table([parsed(Run, row) for row in rows]))


async def _write_csv(client: ServiceClient, wanted: dict[str, Query], limit: int) -> None:
    """The service's own CSV, page by page under one heading."""
    following: dict[str, Query] = {}
    while limit > 0:
        size = min(PAGE, limit)
        text = await client.text("/runs", accept="text/csv", **wanted, **following, limit=size)
        heading, _, rows = text.partition("\r\n")
        typer.echo(rows if following else f"{heading}\r\n{rows}", nl=False)  # as it came: rich would change line ends
        listed = list(csv.reader(io.StringIO(rows, newline="")))
        if len(listed) < size:
            return
        following = {"older_than": listed[-1][0]}
        limit -= size
