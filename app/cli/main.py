"""The waydrop command: which sub-commands there are, and how errors end them."""

from __future__ import annotations

import sys
from importlib.metadata import version
from typing import Annotated

import typer

from app.cli.convert import convert
from app.cli.documents import openapi, schema
from app.cli.fly import fly
from app.cli.jobs import jobs_app
from app.cli.journal import replay, verify_journal
from app.cli.plan_report import findings_of, show_findings
from app.cli.runs import list_filtered, runs_app
from app.cli.serve import serve
from app.cli.sim import sim
from app.cli.terminal import count, err, out, show_error, status_of
from app.cli.token import token_app
from app.cli.up import down, up
from app.cli.validate import validate
from app.cli.vehicles import hold, vehicles
from app.cli.webhook import webhook_app
from app.domain.errors import WaydropError
from app.domain.plan import PlanInvalid
from app.interchange.findings import ConversionRefused

app = typer.Typer(
    name="waydrop",
    help="Checks delivery plans, flies them over MAVLink, proves every drop.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
    epilog="Exit status: 0 done, 1 not achieved, 2 unusable input, 3 no service, 4 refused by the service.",
)


def _version(wanted: bool) -> None:
    if wanted:
        out().print(f"waydrop {version('waydrop')}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Say the version.")] = False,
) -> None:
    """Options of the command itself."""


app.command()(up)
app.command()(down)
app.command()(serve)
app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []})(sim)
app.command()(validate)
app.command()(convert)
app.command()(fly)
app.command()(vehicles)
app.command()(hold)
runs_app.command("list")(list_filtered)
app.add_typer(runs_app, name="runs")
app.add_typer(jobs_app, name="jobs")
app.add_typer(token_app, name="token")
app.add_typer(webhook_app, name="webhook")
app.command("verify-journal")(verify_journal)
app.command()(replay)
app.command()(schema)
app.command()(openapi)


def main() -> None:
    """Run the command of sys.argv. Expected errors are told in words and end with their exit status."""
    try:
        app(prog_name="waydrop")
    except WaydropError as error:
        findings = findings_of(error)
        show_findings(err(), findings)
        if isinstance(error, PlanInvalid):
            err().print(f"[bold red]this is no plan[/]: {count(len(findings), 'error')}")
        elif isinstance(error, ConversionRefused):
            err().print(f"[bold red]this cannot become a plan[/]: {count(len(findings), 'error')}")
        else:
            show_error(error)
        sys.exit(status_of(error))
