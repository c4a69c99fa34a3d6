"""A program flies tasks with the vehicle of a paused run, and the run goes on; or the program goes away: Hold."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from tests.support.service_process import Dispatcher

TASKS = "/vehicles/v1/tasks"
OFFBOARD = "/vehicles/v1/offboard"


@asynccontextmanager
async def renewed(dispatcher: Dispatcher) -> AsyncIterator[str]:
    """A lease whose holder says every second that it is still there."""
    lease: str = (await dispatcher.post(f"{OFFBOARD}/lease", expect=201))["lease"]

    async def renew() -> None:
        while True:
            await dispatcher.post(f"{OFFBOARD}/lease/renew", {"lease": lease})
            await asyncio.sleep(1.0)

    task = asyncio.create_task(renew())
    try:
        yield lease
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
