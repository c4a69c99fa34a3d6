"""`waydrop runs consent`: the question that is asked is answered by its number, and none that nobody asks."""

from __future__ import annotations

import contextlib
import json
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from app.cli.run_changes import answer, consent_line
from app.cli.runs import runs_app
from app.cli.service_client import ServiceClient, service_client
from app.cli.terminal import ExitStatus, ServerRefusedError, status_of
from app.domain.drop.consent import Answer, ConsentRecord, ConsentState
from app.domain.drop.record import DropRecord
from app.domain.errors import ConsentNotAskedError
from tests.support.asking_drop import asked
from tests.support.paths import PLANS
from tests.support.runs_api import create, reaches
from tests.support.service_in_process import Service, run_service

PLAN = PLANS / "clinic-run.json"
GRANT, REFUSE = Answer(grant=True, question=1, comment="clear"), Answer(grant=False)


@contextlib.asynccontextmanager
async def a_run_that_will_ask(folder: Path) -> AsyncIterator[tuple[Service, ServiceClient, dict[str, Any], str]]:
    """A service, a client of it, and the plan and id of a run in flight whose drop needs consent."""
    plan = json.loads(PLAN.read_text())
    next(item for item in plan["items"] if item["type"] == "gripper")["consent"] = "operator"
    async with run_service(folder) as service, service_client(service.url, None) as client:
        stored = await client.post("/plans", plan)
        run_id = (await create(service, stored["id"], start=True))["id"]
        await reaches(service, run_id, "flying")
        yield service, client, plan, run_id


async def test_a_question_is_granted_by_its_number_and_the_other_answer_is_refused(tmp_path: Path) -> None:
    async with a_run_that_will_ask(tmp_path) as (service, client, plan, run_id):
        with pytest.raises(ConsentNotAskedError) as not_asked:
            await answer(client, run_id, None, REFUSE)
        assert status_of(not_asked.value) is ExitStatus.REFUSED
        await asked(service, plan, run_id)
        with pytest.raises(ServerRefusedError) as refused:
            await answer(client, run_id, "drop", replace(GRANT, question=2))
        assert refused.value.code == "drop.consent_not_asked"
        run = await answer(client, run_id, "drop", GRANT)
        assert run.drops[0].consent is not None
        assert run.drops[0].consent.state is ConsentState.GRANTED
        assert consent_line(run.drops[0]) == "consent to drop: granted by local: clear"
        with pytest.raises(ServerRefusedError) as refused:
            await answer(client, run_id, "drop", REFUSE)
        assert refused.value.code == "drop.consent_answered"


async def test_a_refusal_needs_neither_the_drop_nor_the_number(tmp_path: Path) -> None:
    async with a_run_that_will_ask(tmp_path) as (service, client, plan, run_id):
        await asked(service, plan, run_id)
        run = await answer(client, run_id, None, REFUSE)
        assert run.drops[0].consent is not None
        assert run.drops[0].consent.state is ConsentState.REFUSED


@pytest.mark.parametrize("named", [[], ["drop"], ["--question", "1"]])
def test_a_grant_of_what_nobody_says_to_have_seen_is_sent_to_no_service(named: list[str]) -> None:
    plain = {"NO_COLOR": "1", "COLUMNS": "200", "TERM": "dumb"}
    ran = CliRunner(env=plain).invoke(runs_app, ["consent", "r1", *named, "--grant", "--server", "http://127.0.0.1:9"])
    assert ran.exit_code == 2
    assert "--question" in ran.output


def test_a_question_that_is_asked_is_told_with_its_number() -> None:
    record = ConsentRecord(state=ConsentState.ASKED, question=3, deadline_at=1010.0)
    line = consent_line(DropRecord(plan_item_id="drop", supervised=True, consent=record))
    assert line is not None
    assert "request 3" in line
