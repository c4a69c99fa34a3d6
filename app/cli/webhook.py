"""`waydrop webhook`: manage the webhooks of a service."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from app.cli.runs import JsonOption
from app.cli.service_client import ServerOption, TokenOption, parsed, with_client
from app.cli.terminal import AnswerLostError, ExitStatus, OutputError, err, out, write_json
from app.domain.reasons import describe
from app.domain.webhooks.lifecycle import DeliveryEvent
from app.services.webhooks.views import WebhookView

webhook_app = typer.Typer(help="Manage webhooks for deliveries; requires the role admin.", no_args_is_help=True)
HookArgument = Annotated[str, typer.Argument(metavar="WEBHOOK", help="The webhook's id.")]


@webhook_app.command()
def create(
    url: Annotated[
        str, typer.Argument(help="URL that receives the messages, such as https://dispatch.example/waydrop")
    ],
    server: ServerOption,
    token: TokenOption = None,
    event: Annotated[list[DeliveryEvent] | None, typer.Option(help="Send only this event type; repeatable.")] = None,
    description: Annotated[str, typer.Option(help="What it is for, or whose it is.")] = "",
    after: Annotated[
        int | None, typer.Option(min=0, help="Begin after the event with this number; 0 begins with the first.")
    ] = None,
) -> None:
    """Create a webhook. Its secret is written to stdout, once."""
    order: dict[str, Any] = {"url": url, "events": event or [], "description": description, "after": after}
    try:
        made = with_client(server, token, lambda client: client.post("/webhooks", order, repeats=False))
    except AnswerLostError as error:
        hint = "find it with `waydrop webhook list` and delete it: nobody has its secret"
        raise AnswerLostError(error.detail, hint=hint) from error
    err().print(f"webhook {made['webhook']['id']} to {url}; its secret is not shown again:", markup=False)
    try:
        out().out(made["secret"], highlight=False)
    except OutputError as error:
        webhook = made["webhook"]["id"]
        lost = f"{error.detail}: the secret of webhook {webhook} is lost"
        raise OutputError(lost, hint=f"`waydrop webhook delete {webhook}`, and create another") from error


@webhook_app.command("list")
def list_webhooks(server: ServerOption, token: TokenOption = None, as_json: JsonOption = False) -> None:
    """List webhooks with their state."""
    answer = with_client(server, token, lambda client: client.get("/webhooks"))
    if as_json:
        write_json(answer)
    elif not answer["webhooks"]:
        err().print("no webhooks")
    else:
        out().print(_table([parsed(WebhookView, row) for row in answer["webhooks"]]))


@webhook_app.command("test")
def send_test(webhook: HookArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Send one test message now."""
    went = with_client(server, token, lambda client: client.post(f"/webhooks/{webhook}/test"))
    how = f"HTTP {went['status']}" if went["status"] is not None else went["problem"]
    err().print(f"{'delivered' if went['delivered'] else 'NOT delivered'}: {how}", markup=False)
    if not went["delivered"]:
        raise typer.Exit(ExitStatus.NOT_ACHIEVED)


@webhook_app.command()
def enable(
    webhook: HookArgument,
    server: ServerOption,
    token: TokenOption = None,
    skip_missed: Annotated[
        bool, typer.Option("--skip-missed", help="Skip messages that were not delivered yet.")
    ] = False,
) -> None:
    """Enable a webhook. It continues where it stopped."""
    change = {"enabled": True, "skip_missed": skip_missed}
    with_client(server, token, lambda client: client.patch(f"/webhooks/{webhook}", change))
    err().print(f"webhook {webhook} is enabled", markup=False)


@webhook_app.command()
def disable(webhook: HookArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Disable a webhook. Its messages wait until it is enabled again."""
    with_client(server, token, lambda client: client.patch(f"/webhooks/{webhook}", {"enabled": False}))
    err().print(f"webhook {webhook} is disabled", markup=False)


@webhook_app.command()
def delete(webhook: HookArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Delete a webhook."""
    with_client(server, token, lambda client: client.delete(f"/webhooks/{webhook}"))
    err().print(f"webhook {webhook} is deleted", markup=False)


def _table(rows: list[WebhookView]) -> Table:
    table = Table()
    for name in ("webhook", "url", "state", "events behind", "last problem"):
        table.add_column(name, no_wrap=name == "webhook")
    for row in rows:
        problem = describe(row.webhook.disabled_reason) or row.progress.last_problem
        table.add_row(row.webhook.id, row.webhook.url, row.state.value, str(row.events_behind), problem)
    return table
