"""`waydrop runs list`: runs by state, vehicle, plan and time; as a table, JSON or CSV."""

from __future__ import annotations

import asyncio
import csv
import io
from typing import Annotated, Any, Final

import typer

from app.cli.runs import JsonOption, runs_table
from app.cli.service_client import ServerOption, TokenOption, service_client
from app.cli.terminal import err, out, write_json
from app.domain.run import Run, RunState

PAGE: Final = 200


def list_filtered(
    server: ServerOption,
    token: TokenOption = None,
    state: Annotated[list[RunState] | None, typer.Option(help="Runs in this state; repeatable.")] = None,
    vehicle: Annotated[str | None, typer.Option(metavar="ID", help="Runs of this vehicle.")] = None,
    plan: Annotated[str | None, typer.Option(metavar="ID", help="Runs of this plan.")] = None,
    open_only: Annotated[bool, typer.Option("--open", help="Only runs that are not over.")] = False,
    since: Annotated[
        str | None, typer.Option(metavar="TIME", help="Made at or after it: 2026-05-01T00:00:00Z, or Unix seconds.")
    ] = None,
    until: Annotated[str | None, typer.Option(metavar="TIME", help="Made before it.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="At most so many, newest first.")] = 20,
    as_json: JsonOption = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="A table for spreadsheets.")] = False,
) -> None:
    """List runs by what is asked for, newest first."""
    wanted: dict[str, str | int] = {"open": "true"} if open_only else {}
    given = {"vehicle": vehicle, "plan": plan, "created_from": since, "created_before": until}
    wanted |= {name: value for name, value in given.items() if value is not None}
    if state:
        wanted["state"] = ",".join(one.value for one in state)
    if as_csv:
        asyncio.run(_write_csv(server, token, wanted, limit))
        return
    rows = asyncio.run(_rows(server, token, wanted, limit))
    if as_json:
        write_json({"runs": rows})
    elif not rows:
        err().print("no such runs")
    else:
        out().print(runs_table([Run.model_validate(row) for row in rows]))


async def _rows(server: str, token: str | None, wanted: dict[str, str | int], limit: int) -> list[Any]:
    """All rows asked for, page by page."""
    rows: list[Any] = []
    async with service_client(server, token) as client:
        following: dict[str, str | int] = {}
        while len(rows) < limit:
            page = await client.get("/runs", **wanted, **following, limit=min(PAGE, limit - len(rows)))
            rows += page["runs"]
            if page["next"] is None:
                break
            following = {"older_than": page["next"]}
    return rows


async def _write_csv(server: str, token: str | None, wanted: dict[str, str | int], limit: int) -> None:
    """The service's own CSV, page by page under one heading."""
    async with service_client(server, token) as client:
        following: dict[str, str | int] = {}
        while limit > 0:
            size = min(PAGE, limit)
            text = await client.text("/runs", accept="text/csv", **wanted, **following, limit=size)
            heading, _, rows = text.partition("\r\n")
            typer.echo(
                rows if following else f"{heading}\r\n{rows}", nl=False
            )  # as it came: rich would change line ends
            listed = list(csv.reader(io.StringIO(rows, newline="")))
            if len(listed) < size:
                return
            following = {"older_than": listed[-1][0]}
            limit -= size
