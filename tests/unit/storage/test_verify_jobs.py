"""`verify-journal` holds jobs against the events that tell of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.domain.events import NewEvent
from app.domain.events.service import JobChanged, JobQueueChanged
from app.domain.jobs.queue import VehicleQueue
from app.storage import open_storage, verify_journal
from tests.support.job_examples import a_job
from tests.support.reasons import some
from tests.support.stored_samples import plan
from tests.support.verified_journal import alter


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """A journal with one job, and a queue that was stopped."""
    path, job = tmp_path / "journal.db", a_job()
    stopped = VehicleQueue(vehicle_id="v1").stopped_by("ann", some("the operator"), now=2.0)
    async with open_storage(path) as storage:
        await storage.events.append([], plans=[plan()])
        await storage.events.append([NewEvent.of(JobChanged(change="queued", actor="desk", job=job), 1.0)], jobs=[job])
        told = NewEvent.of(JobQueueChanged(change="stopped", queue=stopped), 2.0, vehicle_id="v1")
        await storage.events.append([told], jobs=[stopped])
    return path


async def said(path: Path) -> list[str]:
    return [one for one in (await verify_journal(path)).alterations if "job " in one]


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("UPDATE jobs SET state = state", []),
        ("UPDATE jobs SET state = 'completed'", ["job job-1 differs from its events"]),
        ("UPDATE jobs SET is_over = 1", ["job job-1 differs from its events"]),
        ("UPDATE jobs SET vehicle_id = 'v9'", ["job job-1 differs from its events"]),
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


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("UPDATE job_queues SET vehicle_id = vehicle_id", []),
        ("DELETE FROM job_queues", ["the job queue of v1 exists in events and is missing"]),
        (
            "UPDATE job_queues SET document = replace(document, 'ann', 'ben')",
            ["the job queue of v1 differs from its events"],
        ),
        (
            "UPDATE job_queues SET vehicle_id = 'v2'",
            ["the job queue of v2 is in no event", "the job queue of v1 exists in events and is missing"],
        ),
    ],
)
async def test_a_stop_of_a_queue_that_was_taken_away_is_named(journal: Path, statement: str, words: list[str]) -> None:
    """The stop keeps the next job off a vehicle that somebody must fetch."""
    alter(journal, statement)
    assert await said(journal) == words
