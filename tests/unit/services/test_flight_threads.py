"""Threads for flights: they wait for nobody else's work, and hold no exit up."""

from __future__ import annotations

import asyncio
import threading

import pytest

from app.services.flight_threads import THREADS, FlightThreads, flight_threads
from tests.support.busy_pool import busy_default_pool

PATIENCE_S = 20.0


def _thread() -> str:
    return threading.current_thread().name


async def test_they_have_names_and_do_not_wait_for_the_default_pool() -> None:
    async with busy_default_pool() as other, flight_threads() as threads, asyncio.timeout(PATIENCE_S):
        assert (await threads.run(_thread)).startswith("flight")
        assert not other.done()


async def test_what_is_raised_is_raised() -> None:
    async with flight_threads() as threads:
        with pytest.raises(ZeroDivisionError):
            await threads.run(divmod, 1, 0)


async def test_closing_waits_for_nothing_and_begins_nothing_else() -> None:
    threads, free, begun = FlightThreads(), threading.Event(), threading.Semaphore(0)

    def work() -> bool:
        begun.release()
        return free.wait()

    tasks = [asyncio.create_task(threads.run(work)) for _ in range(THREADS + 1)]
    for _ in range(THREADS):
        await asyncio.to_thread(begun.acquire, timeout=PATIENCE_S)
    threads.close()
    try:
        done, pending = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        assert [task.cancelled() for task in done] == [True], "the one that waited for a thread"
        with pytest.raises(RuntimeError):
            await threads.run(_thread)
    finally:
        free.set()
    assert await asyncio.gather(*pending) == [True] * THREADS
