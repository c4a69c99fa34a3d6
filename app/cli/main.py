"""The waydrop command: which sub-commands there are, and how errors end them."""

from __future__ import annotations

import sys
from importlib.metadata import version
from typing import Annotated, ClassVar, Final

import typer

from app.cli.lazy import LazyCommand, LazyGroup
from app.cli.terminal import count, err, out, show_error, status_of
from app.domain.errors import WaydropError

_ALL_TO_THE_SIMULATOR: Final = {
    "context_settings": {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
}


class _Commands(LazyGroup):
    lazy: ClassVar[tuple[LazyCommand, ...]] = (
        LazyCommand("up", "app.cli.up:up", "Start Waydrop with simulated vehicles. Ctrl-C ends both."),
        LazyCommand(
            "down",
            "app.cli.up:down",
            "End the simulated vehicles that `waydrop up` started, after a Waydrop that died without Ctrl-C.",
        ),
        LazyCommand(
            "serve",
            "app.cli.serve:serve",
            "Start Waydrop. What is not given here comes from WAYDROP_* variables. Ctrl-C ends it; vehicles fly on.",
        ),
        LazyCommand(
            "sim",
            "app.cli.sim:sim",
            "Simulated vehicles that speak MAVLink over UDP. All options go to it: `waydrop sim --help`.",
            _ALL_TO_THE_SIMULATOR,
        ),
        LazyCommand(
            "validate", "app.cli.validate:validate", "Check a plan: its timeline, and every finding with its rule code."
        ),
        LazyCommand(
            "convert",
            "app.cli.convert:convert",
            "Convert a plan. What the file holds is told from its content; each loss and assumption is told on stderr.",
        ),
        LazyCommand(
            "fly",
            "app.cli.fly:fly",
            "Fly a plan and follow it. Exit status 0 only if every drop was released and the run completed.",
        ),
        LazyCommand("vehicles", "app.cli.vehicles:vehicles", "List the vehicles."),
        LazyCommand(
            "hold", "app.cli.vehicles:hold", "Hold where the vehicle is: pauses its run, ends offboard control of it."
        ),
        LazyCommand("runs", "app.cli.runs:runs_app", "List runs, show one, act on one."),
        LazyCommand("jobs", "app.cli.jobs:jobs_app", "Queue plans for a vehicle, or for any that can."),
        LazyCommand("token", "app.cli.token:token_app", "Bearer tokens of this machine's Waydrop."),
        LazyCommand("link-key", "app.cli.link_key:link_key_app", "Signing keys of the vehicle links, on this machine."),
        LazyCommand("webhook", "app.cli.webhook:webhook_app", "Where deliveries are told to; needs the role admin."),
        LazyCommand(
            "audit",
            "app.cli.audit:audit",
            "List who did what and what was refused, newest first. Needs the role admin.",
        ),
        LazyCommand(
            "verify-journal",
            "app.cli.journal:verify_journal",
            "Prove that no event, plan, run or attachment was altered. Prints SEQ:HASH of its newest event: keep it.",
        ),
        LazyCommand(
            "replay",
            "app.cli.journal:replay",
            "Feed a stored run's inputs to this version; show where it decides otherwise. Nothing is sent or stored.",
        ),
        LazyCommand("schema", "app.cli.documents:schema", "Print the JSON Schema (draft 2020-12) of a plan."),
        LazyCommand(
            "openapi", "app.cli.documents:openapi", "Print the OpenAPI 3.1 document, as served at /api/v1/openapi.json."
        ),
    )


app = typer.Typer(
    name="waydrop",
    cls=_Commands,
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


def main() -> None:
    """Run the command of sys.argv. Expected errors are told in words and end with their exit status."""
    try:
        app(prog_name="waydrop")
    except WaydropError as error:
        _show(error)
        sys.exit(status_of(error))


_UNFIT: Final = {"plan.invalid": "this is no plan", "conversion.refused": "this cannot become a plan"}


def _show(error: WaydropError) -> None:
    from app.cli.plan_report import findings_of, show_findings  # here: most commands end without an error
    from app.domain.validation.finding import UnfitDocumentError

    findings = findings_of(error)
    show_findings(err(), findings)
    if isinstance(error, UnfitDocumentError):
        err().print(f"[bold red]{_UNFIT[error.code]}[/]: {count(len(findings), 'error')}")
    else:
        show_error(error)
