"""The waydrop command: which sub-commands there are, and how errors end them."""

from __future__ import annotations

import sys
from io import TextIOWrapper
from typing import Annotated, ClassVar, Final, TextIO, cast

import typer

from app import __version__
from app.cli.lazy import LazyCommand, LazyGroup
from app.cli.terminal import Output, count, err, out, show_error, status_of
from app.domain.errors import WaydropError

_ALL_TO_THE_SIMULATOR: Final = {
    "context_settings": {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
}


class _Commands(LazyGroup):
    lazy: ClassVar[tuple[LazyCommand, ...]] = (
        LazyCommand("up", "app.cli.up:up", "Start Waydrop with simulated vehicles. Ctrl-C stops both."),
        LazyCommand(
            "down",
            "app.cli.up:down",
            "Stop simulated vehicles that `waydrop up` started and that outlived it.",
        ),
        LazyCommand(
            "serve",
            "app.cli.serve:serve",
            "Start Waydrop, configured by options and WAYDROP_* variables. Ctrl-C stops it; vehicles fly on.",
        ),
        LazyCommand(
            "gateway",
            "app.cli.cluster:gateway",
            "Start a gateway of a cluster: the vehicles of one site. It flies them without the others, too.",
        ),
        LazyCommand("api", "app.cli.cluster:api", "Start an API node of a cluster: the vehicles of all its sites."),
        LazyCommand(
            "sim",
            "app.cli.sim:sim",
            "Start simulated vehicles that speak MAVLink over UDP. For its options: `waydrop sim --help`.",
            _ALL_TO_THE_SIMULATOR,
        ),
        LazyCommand(
            "validate", "app.cli.validate:validate", "Check a plan; show its timeline and every finding with its code."
        ),
        LazyCommand(
            "convert",
            "app.cli.convert:convert",
            "Convert a plan. The input format is detected; each loss and assumption is printed to stderr.",
        ),
        LazyCommand(
            "fly",
            "app.cli.fly:fly",
            "Fly a plan and follow it. Exit status 0 only if every drop was released and the run completed.",
        ),
        LazyCommand(
            "health",
            "app.cli.health:health",
            "Ask the Waydrop of these settings whether it is ready, for health checks.",
        ),
        LazyCommand("vehicles", "app.cli.vehicles:vehicles", "List the vehicles."),
        LazyCommand(
            "hold", "app.cli.vehicles:hold", "Hold position: pauses the run of the vehicle and ends offboard control."
        ),
        LazyCommand(
            "take-over",
            "app.cli.vehicles:take_over",
            "Let a gateway take over the site of another one that is switched off. Requires the role admin.",
        ),
        LazyCommand("runs", "app.cli.runs:runs_app", "List runs; show or control one."),
        LazyCommand("jobs", "app.cli.jobs:jobs_app", "Queue plans for one vehicle or any suitable one."),
        LazyCommand("token", "app.cli.token:token_app", "Manage the access tokens of Waydrop on this machine."),
        LazyCommand(
            "link-key", "app.cli.link_key:link_key_app", "Manage the signing keys of vehicle links on this machine."
        ),
        LazyCommand(
            "webhook", "app.cli.webhook:webhook_app", "Manage webhooks for deliveries; requires the role admin."
        ),
        LazyCommand(
            "audit",
            "app.cli.audit:audit",
            "List who did what and what was refused, newest first. Requires the role admin.",
        ),
        LazyCommand(
            "verify-journal",
            "app.cli.journal:verify_journal",
            "Verify that no event, plan, run or attachment was altered. Prints SEQ:HASH of the newest event.",
        ),
        LazyCommand(
            "replay",
            "app.cli.journal:replay",
            "Feed the stored inputs of a run to this version and show different decisions. Sends and stores nothing.",
        ),
        LazyCommand("schema", "app.cli.documents:schema", "Print the JSON Schema (draft 2020-12) of a plan."),
        LazyCommand(
            "openapi", "app.cli.documents:openapi", "Print the OpenAPI 3.1 document, as served at /api/v1/openapi.json."
        ),
    )


app = typer.Typer(
    name="waydrop",
    cls=_Commands,
    help="Check delivery plans, fly them over MAVLink, and record every drop.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
    epilog="Exit status: 0 done, 1 not achieved, 2 unusable input, 3 no service, 4 rejected, 5 output not written.",
)


def _version(wanted: bool) -> None:
    if wanted:
        out().print(f"waydrop {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")] = False,
) -> None:
    """Options of the command itself."""


def main() -> None:
    """Run the command of sys.argv. Expected errors are printed and end with their exit status."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names and arrows, for a terminal of few characters
    if sys.stdout is not None:
        sys.stdout = cast("TextIO", Output(sys.stdout))  # also for what is written without our consoles, as --help is
    try:
        app(prog_name="waydrop")
    except WaydropError as error:
        _show(error)
        sys.exit(status_of(error))


_UNFIT: Final = {"plan.invalid": "this is not a valid plan", "conversion.refused": "this cannot be converted to a plan"}


def _show(error: WaydropError) -> None:
    from app.cli.plan_report import findings_of, show_findings  # here: most commands end without an error
    from app.domain.validation.finding import UnfitDocumentError

    findings = findings_of(error)
    show_findings(err(), findings)
    if isinstance(error, UnfitDocumentError):
        err().print(f"[bold red]{_UNFIT[error.code]}[/]: {count(len(findings), 'error')}")
    else:
        show_error(error)
