"""`verify-journal` holds jobs against the events that tell of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.domain.events import NewEvent
from app.domain.events.service import JobChanged
from app.storage import open_storage, verify_journal
from tests.support.job_examples import a_job
from tests.support.stored_samples import plan
from tests.support.verified_journal import alter


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """A journal with one job."""
    path, job = tmp_path / "journal.db", a_job()
    async with open_storage(path) as storage:
        await storage.events.append([], plans=[plan()])
        await storage.events.append([NewEvent.of(JobChanged(change="queued", actor="desk", job=job), 1.0)], jobs=[job])
    return path


async def said(path: Path) -> list[str]:
    return [one for one in (await verify_journal(path)).alterations if one.startswith("job ")]


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("UPDATE jobs SET state = state", []),
        ("UPDATE jobs SET state = 'completed'", ["job job-1 differs from its events"]),
        (
            "UPDATE jobs SET document = replace(document, '\"auto_start\":false', '\"auto_start\":true')",
            ["job job-1 differs from its events"],
        ),
        (
            "UPDATE jobs SET id = 'job-2'",
            ["job job-2 is in no event", "job job-1 exists in events and is missing"],
        ),
        ("DELETE FROM jobs", ["job job-1 exists in events and is missing"]),
    ],
)
async def test_what_was_altered_of_a_job_is_named(journal: Path, statement: str, words: list[str]) -> None:
    alter(journal, statement)
    assert await said(journal) == words
