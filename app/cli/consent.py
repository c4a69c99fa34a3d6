"""`waydrop runs consent`: answer a drop that asks for an operator's consent."""

from __future__ import annotations

import asyncio
from datetime import datetime
from typing import Annotated, Any

import typer

from app.cli.run_view import drops_table
from app.cli.service_client import ServerOption, ServiceClient, TokenOption, service_client
from app.cli.terminal import out
from app.domain.consent import Answer, ConsentState
from app.domain.drop import DropRecord
from app.domain.errors import ConsentNotAskedError
from app.domain.reason import in_words
from app.domain.run import Run


def answer_consent(
    run: Annotated[str, typer.Argument(metavar="RUN", help="The run's id.")],
    server: ServerOption,
    grant: Annotated[bool, typer.Option("--grant/--refuse", help="Let it go, or keep it on board.")],
    drop: Annotated[
        str | None, typer.Argument(metavar="DROP", help="The drop's id; a refusal may leave it out.")
    ] = None,
    question: Annotated[
        int | None, typer.Option(min=1, help="Number of the question that you have seen; a refusal may leave it out.")
    ] = None,
    comment: Annotated[str, typer.Option(help="Your words for the proof of delivery.")] = "",
    token: TokenOption = None,
) -> None:
    """Answer a drop that asks for consent; the first answer counts, and no answer in time is a refusal."""
    if grant and (drop is None or question is None):
        raise typer.BadParameter(f"--grant needs DROP and --question: look at what is asked, waydrop runs show {run}")
    said = Answer(grant=grant, question=question, comment=comment)
    answered = asyncio.run(_answer(server, token, run, drop, said))
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
        until = (
            f" as question {consent.question} until {datetime.fromtimestamp(consent.deadline_at).strftime('%H:%M:%S')}"
        )
    by = f" by {consent.answered_by}" if consent.answered_by else ""
    said = consent.comment or in_words(consent.reason)
    why = f": {said}" if said else ""
    return f"consent to {drop.plan_item_id}: {consent.state.value.replace('_', ' ')}{until}{by}{why}"


async def answer(client: ServiceClient, run_id: str, drop_id: str | None, said: Answer) -> Run:
    """Answer the named drop; a refusal may name none, then the question that is asked now is refused, no later one.

    Raises:
        ConsentNotAskedError: no drop asks. ServerRefusedError: another answer came first, or this one too late.
    """
    question = said.question
    if drop_id is None:
        asking = _asking(Run.model_validate(await client.get(f"/runs/{run_id}")))
        drop_id = asking.plan_item_id
        if question is None and asking.consent is not None:
            question = asking.consent.question
    document: dict[str, Any] = {"grant": said.grant, "question": question, "comment": said.comment}
    return Run.model_validate(await client.post(f"/runs/{run_id}/drops/{drop_id}/consent", document))


async def _answer(server: str, token: str | None, run_id: str, drop_id: str | None, said: Answer) -> Run:
    async with service_client(server, token) as client:
        return await answer(client, run_id, drop_id, said)


def _asking(run: Run) -> DropRecord:
    """The drop that asks; a vehicle is at one drop at a time."""
    for drop in run.drops:
        if drop.consent is not None and drop.consent.state is ConsentState.ASKED:
            return drop
    raise ConsentNotAskedError(f"no drop of run {run.id} asks for consent now", hint=f"waydrop runs show {run.id}")
