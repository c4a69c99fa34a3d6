"""`waydrop runs change`, `insert` and `continue`: where a run goes on, in flight or as another run."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli.plan_file import read_file, read_plan
from app.cli.service_client import ServerOption, ServiceClient, TokenOption, service_client
from app.cli.terminal import err
from app.cli.wind_option import WindOption, wind_given
from app.domain.errors import InvalidInputError
from app.domain.plan.json_tree import read_json
from app.domain.run import Run

RunArgument = Annotated[str, typer.Argument(metavar="RUN", help="The run's id.")]


def change_mission(
    run: RunArgument,
    server: ServerOption,
    plan: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="The changed plan; none: the run's own.")
    ] = None,
    at: Annotated[str | None, typer.Option("--at", help="Go on with this item; none: the one flown now.")] = None,
    token: TokenOption = None,
) -> None:
    """Fly on with a changed plan, or skip to an item, without a pause. Drops that are over are not visited again."""
    if plan is None and at is None:
        raise InvalidInputError("nothing to change", hint="name a plan file, --at ITEM, or both")
    document = None if plan is None else read_plan(plan).model_dump(mode="json")

    async def order(client: ServiceClient) -> Any:
        plan_id = None if document is None else (await client.post("/plans", document))["id"]
        return await client.post(f"/runs/{run}/mission", {"plan": plan_id, "continue_at": at})

    _tell(asyncio.run(_with_client(server, token, order)))


def insert_stops(
    run: RunArgument,
    items: Annotated[Path, typer.Argument(metavar="FILE", help="JSON: one item of a plan, or a list of them.")],
    server: ServerOption,
    before: Annotated[str | None, typer.Option("--before", help="Before the stop of this item.")] = None,
    after: Annotated[str | None, typer.Option("--after", help="Behind the stop of this item.")] = None,
    token: TokenOption = None,
) -> None:
    """Put more items into a run in flight, before or after a stop that is still to come."""
    found = read_json(read_file(items))
    if found.findings:
        raise InvalidInputError(f"{items}: {found.findings[0].message}", hint="it holds one item, or a list of them")
    listed = found.value if isinstance(found.value, list) else [found.value]
    body = {"items": listed, "before": before, "after": after}

    async def order(client: ServiceClient) -> Any:
        return await client.post(f"/runs/{run}/stops", body)

    _tell(asyncio.run(_with_client(server, token, order)))


def continue_run(
    run: RunArgument,
    server: ServerOption,
    at: Annotated[
        str | None, typer.Option("--at", help="Go on with this item; none: behind the last one done.")
    ] = None,
    wind: WindOption = None,
    token: TokenOption = None,
) -> None:
    """Make a new run of what is left of one that ended early, without drops that are over; it waits for its start."""
    given = wind_given(wind)
    body = {"continue_at": at, "wind": None if given is None else given.model_dump(mode="json")}

    async def order(client: ServiceClient) -> Any:
        return await client.post(f"/runs/{run}/continuation", body)

    new = Run.model_validate(asyncio.run(_with_client(server, token, order)))
    start = f"waydrop runs start {new.id}"
    err().print(f"run {new.id} continues run {run} with plan {new.plan_id}; start it: {start}", markup=False)


async def _with_client(server: str, token: str | None, order: Any) -> Any:
    async with service_client(server, token) as client:
        return await order(client)


def _tell(answer: Any) -> None:
    run = Run.model_validate(answer)
    change = run.change
    where = "" if change is None else f" from {change.continue_at} on"
    left_out = "" if change is None or not change.left_out else f"; not visited again: {', '.join(change.left_out)}"
    err().print(f"run {run.id} flies plan {run.plan_id}{where}{left_out}", markup=False)
