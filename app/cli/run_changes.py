"""`waydrop runs change`, `insert` and `continue`: where a run goes on, in flight or as another run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli.plan_report import WindOption, read_file, read_plan, wind_given
from app.cli.run_view import drops_table
from app.cli.service_client import ServerOption, ServiceClient, TokenOption, parsed, with_client
from app.cli.terminal import err, out
from app.cli.times import clock_time
from app.domain.drop.consent import Answer, ConsentState
from app.domain.drop.record import DropRecord
from app.domain.errors import ConsentNotAskedError, InvalidInputError
from app.domain.plan.json_tree import read_json
from app.domain.reasons import describe
from app.domain.run.run import Run


def answer_consent(
    run: Annotated[str, typer.Argument(metavar="RUN", help="The run's id.")],
    server: ServerOption,
    grant: Annotated[bool, typer.Option("--grant/--refuse", help="Grant or refuse the release.")],
    drop: Annotated[str | None, typer.Argument(metavar="DROP", help="ID of the drop; optional for a refusal.")] = None,
    question: Annotated[
        int | None, typer.Option(min=1, help="Number of the consent request; optional for a refusal.")
    ] = None,
    comment: Annotated[str, typer.Option(help="Comment for the delivery report.")] = "",
    token: TokenOption = None,
) -> None:
    """Answer a drop that asks for consent; the first answer counts, and no response in time is a refusal."""
    if grant and (drop is None or question is None):
        raise typer.BadParameter(f"--grant requires DROP and --question: see waydrop runs show {run}")
    said = Answer(grant=grant, question=question, comment=comment)
    answered = with_client(server, token, lambda client: answer(client, run, drop, said))
    out().print(drops_table(answered))
    for record in answered.drops:
        if (line := consent_line(record)) is not None:
            out().print(line, markup=False)


def consent_line(drop: DropRecord) -> str | None:
    """Where the consent to a drop stands, in a line; None if it needs none."""
    consent = drop.consent
    if consent is None:
        return None
    until = ""
    if consent.state is ConsentState.ASKED and consent.deadline_at is not None:
        until = f" as request {consent.question} until {clock_time(consent.deadline_at)}"
    actor = f" by {consent.answered_by}" if consent.answered_by else ""
    said = consent.comment or describe(consent.reason)
    why = f": {said}" if said else ""
    return f"consent to {drop.plan_item_id}: {consent.state.value.replace('_', ' ')}{until}{actor}{why}"


async def answer(client: ServiceClient, run_id: str, drop_id: str | None, said: Answer) -> Run:
    """Answer the named drop; a refusal without a name applies to the pending request only.

    Raises:
        ConsentNotAskedError: no request is pending. ServerRefusedError: it was answered before, or too late.
    """
    question = said.question
    if drop_id is None:
        asking = _asking(parsed(Run, await client.get(f"/runs/{run_id}")))
        drop_id = asking.plan_item_id
        if question is None and asking.consent is not None:
            question = asking.consent.question
    document: dict[str, Any] = {"grant": said.grant, "question": question, "comment": said.comment}
    return parsed(Run, await client.post(f"/runs/{run_id}/drops/{drop_id}/consent", document))


def _asking(run: Run) -> DropRecord:
    """The drop with a pending request; a vehicle is at one drop at a time."""
    for drop in run.drops:
        if drop.consent is not None and drop.consent.state is ConsentState.ASKED:
            return drop
    raise ConsentNotAskedError(
        f"no drop of run {run.id} has a pending consent request", hint=f"waydrop runs show {run.id}"
    )


RunArgument = Annotated[str, typer.Argument(metavar="RUN", help="The run's id.")]


def change_mission(
    run: RunArgument,
    server: ServerOption,
    plan: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="The changed plan; default: the plan of the run.")
    ] = None,
    at: Annotated[str | None, typer.Option("--at", help="Continue with this item; default: the current one.")] = None,
    token: TokenOption = None,
) -> None:
    """Fly on with a changed plan, or skip to an item, without a pause. Drops that are over are not visited again."""
    if plan is None and at is None:
        raise InvalidInputError("nothing to change", hint="specify a plan file, --at ITEM, or both")
    document = None if plan is None else read_plan(plan).model_dump(mode="json")

    async def order(client: ServiceClient) -> Any:
        plan_id = None if document is None else (await client.post("/plans", document))["id"]
        return await client.post(f"/runs/{run}/mission", {"plan": plan_id, "continue_at": at})

    _print(with_client(server, token, order))


def insert_items(
    run: RunArgument,
    items: Annotated[
        Path, typer.Argument(metavar="FILE", help="JSON file with one item of a plan or a list of items.")
    ],
    server: ServerOption,
    before: Annotated[str | None, typer.Option("--before", help="Insert before the stop of this item.")] = None,
    after: Annotated[str | None, typer.Option("--after", help="Insert after the stop of this item.")] = None,
    token: TokenOption = None,
) -> None:
    """Put more items into a run in flight, before or after a stop that is still to come."""
    found = read_json(read_file(items))
    if found.findings:
        raise InvalidInputError(
            f"{items}: {found.findings[0].message}", hint="the file must contain one item or a list of items"
        )
    listed = found.value if isinstance(found.value, list) else [found.value]
    body = {"items": listed, "before": before, "after": after}
    _print(with_client(server, token, lambda client: client.post(f"/runs/{run}/inserted-items", body)))


def continue_run(
    run: RunArgument,
    server: ServerOption,
    at: Annotated[
        str | None, typer.Option("--at", help="Continue with this item; default: after the last one that was flown.")
    ] = None,
    wind: WindOption = None,
    token: TokenOption = None,
) -> None:
    """Create a run of the remaining items of one that ended early, without completed drops; start it separately."""
    given = wind_given(wind)
    body = {"continue_at": at, "wind": None if given is None else given.model_dump(mode="json")}
    new = parsed(Run, with_client(server, token, lambda client: client.post(f"/runs/{run}/continuation", body)))
    start = f"waydrop runs start {new.id}"
    err().print(f"run {new.id} continues run {run} with plan {new.plan_id}; start it: {start}", markup=False)


def _print(answer: Any) -> None:
    run = parsed(Run, answer)
    change = run.change
    where = "" if change is None else f" from {change.continue_at} on"
    omitted = "" if change is None or not change.omitted else f"; not visited again: {', '.join(change.omitted)}"
    err().print(f"run {run.id} flies plan {run.plan_id}{where}{omitted}", markup=False)
