"""Where a plan is worked on: large ones in the worker, others and those that it loses in a thread."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.domain.errors import PlanWorkTimeoutError
from app.domain.plan import parse_plan
from app.services.plan_work import CIRCLE_WEIGHT, LARGE_DOCUMENT_BYTES, LARGE_ENTRIES, PlanWork, entries_of
from app.services.worker_process import WorkerProcess
from tests.support.plan_pieces import RETURN, circle, plan_json, takeoff
from tests.support.service_in_process import until
from tests.support.worker_calls import end_any_worker, own_pid, tell, what_was_told
from tests.support.workers import stopped, workers_of

LARGE: dict[str, Any] = {"items": [{}] * LARGE_ENTRIES}
LARGE_DOCUMENT = bytes(LARGE_DOCUMENT_BYTES)


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
        ({"geofence": {"circles": [{}] * (LARGE_ENTRIES // CIRCLE_WEIGHT)}}, False),
        ({"geofence": {"circles": [{}] * (LARGE_ENTRIES // CIRCLE_WEIGHT + 1)}}, True),
        ({f"k{number}": 0 for number in range(2 * LARGE_ENTRIES)}, True),
        ({"name": "x" * 1000}, False),
        (None, False),
        ("text", False),
    ],
    ids=["items", "many items", "vertices", "circles", "many circles", "fields", "a name", "null", "text"],
)
def test_what_is_large(document: Any, *, is_large: bool) -> None:
    assert (entries_of(document) >= LARGE_ENTRIES) is is_large


async def test_large_work_is_done_in_the_worker(worker: WorkerProcess) -> None:
    assert await PlanWork(worker).run(LARGE, os.getpid) == worker.pid


async def test_small_work_starts_none(worker: WorkerProcess) -> None:
    assert await PlanWork(worker).run({}, os.getpid) == os.getpid()
    assert worker.pid is None


@pytest.mark.parametrize("size_bytes", [LARGE_DOCUMENT_BYTES - 1, LARGE_DOCUMENT_BYTES])
async def test_a_large_document_is_worked_on_in_the_worker(worker: WorkerProcess, size_bytes: int) -> None:
    pid = await PlanWork(worker).run_document(bytes(size_bytes), own_pid)
    assert pid == (os.getpid() if size_bytes < LARGE_DOCUMENT_BYTES else worker.pid)


async def test_a_plan_waits_for_one_large_document_at_most(worker: WorkerProcess, tmp_path: Path) -> None:
    work, told = PlanWork(worker), str(tmp_path / "told")
    with stopped(await worker.call(os.getpid)):
        documents = [asyncio.create_task(work.run_document(LARGE_DOCUMENT, tell, told, "document")) for _ in range(5)]
        await until(lambda: worker.is_busy)
        plan = asyncio.create_task(work.run(LARGE, tell, b"", told, "plan"))
        await asyncio.sleep(0)  # it waits its turn now
    await asyncio.gather(plan, *documents)
    assert what_was_told(told).index("plan") <= 2


async def test_a_document_whose_sender_gives_up_leaves_the_queue(worker: WorkerProcess, tmp_path: Path) -> None:
    work, told = PlanWork(worker), str(tmp_path / "told")
    with stopped(await worker.call(os.getpid)):
        documents = [asyncio.create_task(work.run_document(LARGE_DOCUMENT, tell, told, "document")) for _ in range(5)]
        await until(lambda: worker.is_busy)
        for document in documents:
            document.cancel()
    await work.run_document(LARGE_DOCUMENT, tell, told, "last")
    assert what_was_told(told) in (["document", "last"], ["last"])


async def test_work_that_the_worker_loses_is_done_here(worker: WorkerProcess) -> None:
    assert await PlanWork(worker).run(LARGE, end_any_worker) == os.getpid()
    assert await PlanWork(worker).run(LARGE, os.getpid) == worker.pid, "the next one has a new worker"


async def test_work_that_takes_the_worker_too_long_is_given_up(tmp_path: Path) -> None:
    worker, told = WorkerProcess(answer_s=15.0), str(tmp_path / "told")
    pid = await worker.call(os.getpid)
    os.kill(pid, signal.SIGSTOP)
    with pytest.raises(PlanWorkTimeoutError):
        await PlanWork(worker).run(LARGE, tell, b"", told, "twice")
    tell(b"", told, "now")
    assert what_was_told(told) == ["now"], "the service did not do it itself"
    await worker.close()


def test_a_plan_weighs_as_much_as_its_document() -> None:
    document = plan_json("multicopter", takeoff(), RETURN, geofence={"circles": [circle("exclusion", 90, 0, 9)] * 12})
    assert entries_of(parse_plan(document)) == 2 + 12 * CIRCLE_WEIGHT
    assert entries_of(document) >= LARGE_ENTRIES - 2


async def test_a_defect_is_raised_as_in_a_thread(worker: WorkerProcess) -> None:
    with pytest.raises(TypeError):
        await PlanWork(worker).run(LARGE, abs, "no number")


async def test_without_a_worker_all_is_done_here() -> None:
    assert await PlanWork().run(LARGE, os.getpid) == os.getpid()
    assert workers_of(os.getpid()) == []
