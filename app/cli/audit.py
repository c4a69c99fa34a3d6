"""`waydrop audit`: who did what, and what was refused."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from app.cli.runs import JsonOption
from app.cli.service_client import Query, ServerOption, TokenOption, parsed, with_client
from app.cli.terminal import err, out, write_json
from app.cli.times import date_and_time, time_option
from app.domain.audit import AuditEntry, AuditOutcome

PAGE = 500


def audit(
    server: ServerOption,
    token: TokenOption = None,
    actor: Annotated[str | None, typer.Option(metavar="NAME", help="Actor: show only its entries.")] = None,
    outcome: Annotated[AuditOutcome | None, typer.Option(help="How it ended.")] = None,
    since: Annotated[
        str | None, time_option("Show entries since this time, such as 2026-05-01T00:00:00Z, or Unix seconds.")
    ] = None,
    until: Annotated[str | None, time_option("Show entries before this time.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Maximum number of results, newest first.")] = 20,
    as_json: JsonOption = False,
) -> None:
    """List who did what and what was refused, newest first. Requires the role admin."""
    wanted: dict[str, Query] = {"actor": actor, "outcome": outcome, "since": since, "before": until}
    rows = with_client(server, token, lambda client: client.pages("/audit", "entries", "cursor", PAGE, limit, **wanted))
    if as_json:
        write_json({"entries": rows})
    elif not rows:
        err().print("no such entries")
    else:
        out().print(_table([parsed(AuditEntry, row) for row in rows]))


def _table(entries: list[AuditEntry]) -> Table:
    table = Table()
    for column in ("time", "who", "from", "action", "on", "outcome"):
        table.add_column(column)
    for entry in entries:
        outcome = entry.outcome.value + (f": {entry.code}" if entry.code else "")
        times = f" ({entry.count} times)" if entry.count > 1 else ""
        who, address = entry.actor or "-", entry.address or "-"
        table.add_row(date_and_time(entry.time), who, address, entry.action, entry.target, outcome + times)
    return table
