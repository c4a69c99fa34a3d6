"""Tasks with an owner: each has a name, and ends with the block or the object that it belongs to."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from typing import Any

import structlog

log = structlog.get_logger(__name__)


@asynccontextmanager
async def background(work: Coroutine[Any, Any, None], name: str) -> AsyncIterator[None]:
    """Run `work` until the block ends."""
    task = begin_task(work, name)
    try:
        yield
    finally:
        await end_tasks(task)


def begin_task(work: Coroutine[Any, Any, None], name: str) -> asyncio.Task[None]:
    """A task of its own, for `end_tasks`. A defect that ends it earlier is logged."""
    task = asyncio.create_task(work, name=name)
    task.add_done_callback(_log_defect)
    return task


async def end_tasks(*tasks: asyncio.Future[Any] | None) -> None:
    """Cancel those that were begun, and return when they have ended, however they ended."""
    begun = [task for task in tasks if task is not None]
    for task in begun:
        task.cancel()
    await asyncio.gather(*begun, return_exceptions=True)


def _log_defect(task: asyncio.Task[None]) -> None:
    if not task.cancelled() and (error := task.exception()) is not None:
        log.error("a part of this process has failed: restart it", part=task.get_name(), exc_info=error)
