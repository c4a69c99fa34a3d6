"""`waydrop runs consent`: the question that is asked is answered, and none that nobody asks."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli.consent import answer, consent_line
from app.cli.exit_status import ExitStatus, ServerRefusedError, status_of
from app.cli.service_client import service_client
from app.domain.consent import ConsentState
from app.domain.errors import ConsentNotAskedError
from tests.api.service import run_service
from tests.api.test_consents import asked
from tests.api.test_runs import create, reaches

PLAN = Path(__file__).resolve().parents[3] / "plans" / "clinic-run.json"


async def test_a_question_is_answered_without_naming_the_drop_and_the_other_answer_is_refused(tmp_path: Path) -> None:
    plan = json.loads(PLAN.read_text())
    next(item for item in plan["items"] if item["type"] == "gripper")["consent"] = "operator"
    async with run_service(tmp_path) as service, service_client(service.url, None) as client:
        stored = await client.post("/plans", plan)
        run_id = (await create(service, stored["id"], start=True))["id"]
        await reaches(service, run_id, "flying")
        with pytest.raises(ConsentNotAskedError) as not_asked:
            await answer(client, run_id, None, grant=True)
        assert status_of(not_asked.value) is ExitStatus.REFUSED
        await asked(service, plan, run_id)
        run = await answer(client, run_id, None, grant=True, reason="clear")
        assert run.drops[0].consent is not None
        assert run.drops[0].consent.state is ConsentState.GRANTED
        assert consent_line(run.drops[0]) == "consent to drop: granted by local: clear"
        with pytest.raises(ServerRefusedError) as refused:
            await answer(client, run_id, "drop", grant=False)
        assert refused.value.code == "drop.consent_answered"
