"""The worker process: started when needed, lost in every way, and ended with its parent."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from app.services.worker_main import NICE
from app.services.worker_process import WorkerLostError, WorkerProcess, WorkerTimeoutError
from tests.support.service_in_process import until
from tests.support.workers import is_there

PARENT = """
import asyncio, os
from app.services.worker_process import WorkerProcess

async def main():
    worker = WorkerProcess()
    print(await worker.call(os.getpid), flush=True)
    await worker.call(exec, {work!r})
    await asyncio.sleep(60)

asyncio.run(main())
"""


@pytest.fixture
async def worker() -> AsyncIterator[WorkerProcess]:
    process = WorkerProcess()
    yield process
    await process.close()


async def begun(worker: WorkerProcess, seconds: float) -> asyncio.Task[None]:
    """A call that takes that long, under way."""
    await worker.call(abs, 0)
    call = asyncio.create_task(worker.call(time.sleep, seconds))
    await until(lambda: worker.is_busy)
    return call


async def test_it_starts_at_the_first_call_and_stays(worker: WorkerProcess) -> None:
    assert worker.pid is None
    pid = await worker.call(os.getpid)
    assert pid == worker.pid
    assert pid != os.getpid()
    assert await worker.call(os.getpid) == pid


async def test_it_has_less_of_a_busy_machine_than_the_service(worker: WorkerProcess) -> None:
    assert await worker.call(os.nice, 0) == min(19, os.nice(0) + NICE)


async def test_a_large_answer_to_a_large_call_arrives_whole(worker: WorkerProcess) -> None:
    assert await worker.call(bytes.upper, b"a" * 5_000_000) == b"A" * 5_000_000


async def test_what_a_function_prints_is_no_answer(worker: WorkerProcess) -> None:
    assert await worker.call(print, "told") is None
    assert await worker.call(abs, -3) == 3


async def test_a_worker_that_was_killed_is_started_again(worker: WorkerProcess) -> None:
    pid = await worker.call(os.getpid)
    os.kill(pid, signal.SIGKILL)
    await until(lambda: worker.pid is None)
    assert await worker.call(os.getpid) not in (pid, os.getpid())


async def test_a_call_whose_worker_is_killed_ends_and_the_next_one_is_answered(worker: WorkerProcess) -> None:
    call = await begun(worker, 60.0)
    following = asyncio.create_task(worker.call(abs, -3))
    os.kill(worker.pid or 0, signal.SIGKILL)
    with pytest.raises(WorkerLostError):
        await call
    assert await following == 3


async def test_a_defect_in_a_function_loses_the_worker_and_nothing_else(worker: WorkerProcess) -> None:
    with pytest.raises(WorkerLostError):
        await worker.call(abs, "no number")
    assert await worker.call(abs, -3) == 3


async def test_a_worker_that_stands_still_is_given_up() -> None:
    worker = WorkerProcess(answer_s=15.0)
    pid = await worker.call(os.getpid)
    os.kill(pid, signal.SIGSTOP)
    impatient = asyncio.create_task(worker.call(abs, -3))
    with pytest.raises(WorkerTimeoutError):
        await impatient
    assert not is_there(pid)
    assert await worker.call(abs, -3) == 3
    await worker.close()


async def test_a_cancelled_call_leaves_its_answer_to_nobody(worker: WorkerProcess) -> None:
    call = await begun(worker, 0.3)
    pid = worker.pid
    waiting = [asyncio.create_task(worker.call(time.sleep, 60.0)) for _ in range(20)]
    for task in (call, *waiting):
        task.cancel()
    assert await worker.call(abs, -3) == 3, "those that waited are gone, and the answer is its own"
    assert worker.pid == pid


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_signals_are_for_the_service(worker: WorkerProcess, number: signal.Signals) -> None:
    pid = await worker.call(os.getpid)
    os.kill(pid, number)
    assert await worker.call(os.getpid) == pid


async def test_a_ctrl_c_in_the_terminal_does_not_reach_it(worker: WorkerProcess) -> None:
    assert os.getpgid(await worker.call(os.getpid)) != os.getpgid(0)


async def test_closing_ends_it_also_in_the_middle_of_a_call(worker: WorkerProcess) -> None:
    call = await begun(worker, 60.0)
    pid = worker.pid
    await worker.close()
    assert not is_there(pid or 0)
    with pytest.raises(WorkerLostError):
        await call
    with pytest.raises(WorkerLostError):
        await worker.call(abs, -3)
    assert worker.pid is None, "it starts none after its end"


async def test_a_worker_that_cannot_be_started_is_lost(worker: WorkerProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(sys, "executable", "/no/python")
        with pytest.raises(WorkerLostError):
            await worker.call(abs, -3)
    assert await worker.call(abs, -3) == 3


@pytest.mark.parametrize("is_busy", [False, True], ids=["idle", "at work"])
async def test_it_ends_with_a_parent_that_is_killed(tmp_path: Path, *, is_busy: bool) -> None:
    working = tmp_path / "working"
    work = f"import pathlib, time; pathlib.Path({str(working)!r}).touch(); time.sleep({60 * is_busy})"
    script = PARENT.format(work=work)
    parent = await asyncio.create_subprocess_exec(sys.executable, "-c", script, stdout=asyncio.subprocess.PIPE)
    assert parent.stdout is not None
    pid = int(await parent.stdout.readline())
    await until(working.exists)
    assert is_there(pid)
    parent.kill()
    await parent.wait()
    await until(lambda: not is_there(pid))
