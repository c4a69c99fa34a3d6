"""Where a plan is worked on: large ones in the worker, others and those that it loses in a thread."""

from __future__ import annotations

import os
import signal
from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.services.plan_work import LARGE_ENTRIES, PlanWork, entries_of
from app.services.worker_process import WorkerProcess
from tests.support.workers import is_worker, workers_of

LARGE: dict[str, Any] = {"items": [{}] * LARGE_ENTRIES}


@pytest.fixture
async def worker() -> AsyncIterator[WorkerProcess]:
    process = WorkerProcess()
    yield process
    await process.close()


@pytest.mark.parametrize(
    ("document", "is_large"),
    [
        ({"items": [{"type": "waypoint", "id": "a", "latitude_deg": 1}] * (LARGE_ENTRIES - 1)}, False),
        (LARGE, True),
        ({"geofence": {"polygons": [{"vertices": [{}] * (LARGE_ENTRIES // 2)}] * 2}}, True),
        ({f"k{number}": 0 for number in range(2 * LARGE_ENTRIES)}, True),
        ({"name": "x" * 1000}, False),
        (None, False),
        ("text", False),
    ],
    ids=["items", "many items", "vertices", "fields", "a name", "null", "text"],
)
def test_what_is_large(document: Any, *, is_large: bool) -> None:
    assert (entries_of(document) >= LARGE_ENTRIES) is is_large


async def test_large_work_is_done_in_the_worker(worker: WorkerProcess) -> None:
    assert await PlanWork(worker).run(LARGE, os.getpid) == worker.pid


async def test_small_work_starts_none(worker: WorkerProcess) -> None:
    assert await PlanWork(worker).run({}, os.getpid) == os.getpid()
    assert worker.pid is None


async def test_work_that_the_worker_loses_is_done_here(worker: WorkerProcess) -> None:
    assert await PlanWork(worker).run(LARGE, _end_any_worker) == os.getpid()
    assert await PlanWork(worker).run(LARGE, os.getpid) == worker.pid, "the next one has a new worker"


async def test_a_defect_is_raised_as_in_a_thread(worker: WorkerProcess) -> None:
    with pytest.raises(TypeError):
        await PlanWork(worker).run(LARGE, abs, "no number")


async def test_without_a_worker_all_is_done_here() -> None:
    assert await PlanWork().run(LARGE, os.getpid) == os.getpid()
    assert workers_of(os.getpid()) == []


def _end_any_worker() -> int:
    """Kills its own process if that is a worker."""
    if is_worker(os.getpid()):
        os.kill(os.getpid(), signal.SIGKILL)
    return os.getpid()
