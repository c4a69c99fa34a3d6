"""`verify-journal` takes a pruned journal as it is, and finds what was altered in one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.services.journal import Journal
from app.services.retention import Retention, RetentionPeriods
from app.storage import open_storage, verify_journal
from tests.support.fakes import ManualClock
from tests.support.old_journal import TODAY_S, History
from tests.support.verified_journal import DOCUMENT, alter

OTHER = json.dumps(DOCUMENT | {"version": 2})


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """Events 1 to 6 were deleted. plan-1 was posted in them, and run-2 flew it since; run-1 began in them."""
    path = tmp_path / "journal.db"
    async with open_storage(path) as storage:
        history = History(storage.events)
        posted = await history.plan(1, day=1)
        await history.items(day=2, count=4)
        await history.run(1, posted, day=69, ended=71)
        await history.run(2, posted, day=90, ended=91)
        recorded = Journal(storage.events, ManualClock(TODAY_S))
        await recorded.start()
        periods = RetentionPeriods.of_days(30, None)
        retention = Retention(
            storage.retention, recorded, ManualClock(TODAY_S), periods, forget_plans=lambda plans: None
        )
        await retention.prune()
        await recorded.close()
    return path


async def test_a_pruned_journal_is_as_written(journal: Path) -> None:
    found = await verify_journal(journal)
    assert (found.alterations, found.events, found.plans, found.runs) == ([], 6, 1, 2)
    assert found.heads[found.journal].seq == 12


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("DELETE FROM events WHERE seq = 7", "event 8: it does not follow event 0"),
        ("DELETE FROM events WHERE seq = 9", "event 10: it does not follow event 8"),
        ("UPDATE events SET time = time + 1 WHERE seq = 7", "event 7: its hash does not follow from that of event 6"),
        ("UPDATE events SET data = replace(data, '\"seq\":6', '\"seq\":7')", "event 12: its hash is wrong"),
        ("DELETE FROM events WHERE kind = 'journal.pruned'", "event 7: it does not follow event 0"),
        (f"UPDATE plans SET document = '{OTHER}'", "plan plan-1 differs from the created one"),
        ("UPDATE plans SET id = 'plan-2'", "plan plan-2 is in no event"),
        ("UPDATE runs SET state = 'failed' WHERE id = 'run-1'", "run run-1 differs from its events"),
        ("DELETE FROM runs WHERE id = 'run-1'", "run run-1 exists in events and is missing"),
    ],
)
async def test_what_was_altered_in_a_pruned_journal_is_found(journal: Path, statement: str, said: str) -> None:
    alter(journal, statement)
    assert any(said in line for line in (await verify_journal(journal)).alterations)
