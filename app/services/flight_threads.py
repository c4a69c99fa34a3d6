"""Threads for what flights need. The default pool is for everybody: a flight would wait in it behind their work."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from typing import Any, Final, TypeVar

THREADS: Final = 3
"""One may wait for the disk. More get no more done: the interpreter runs one at a time."""
ResultT = TypeVar("ResultT")


class FlightThreads:
    """Starts a thread when it is needed first."""

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(THREADS, thread_name_prefix="flight")

    async def run(self, work: Callable[..., ResultT], /, *given: Any) -> ResultT:
        """See InThread."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, work, *given)

    def close(self) -> None:
        """Nothing else is begun. What runs is not waited for: by now nobody needs what it computes."""
        self._threads.shutdown(wait=False, cancel_futures=True)


@asynccontextmanager
async def flight_threads() -> AsyncIterator[FlightThreads]:
    """They end with the block."""
    threads = FlightThreads()
    try:
        yield threads
    finally:
        threads.close()
