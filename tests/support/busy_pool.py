"""A default thread pool that others keep busy."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager


@asynccontextmanager
async def busy_default_pool() -> AsyncIterator[asyncio.Future[bool]]:
    """Its only thread is taken until the block ends; the future is what it does."""
    free, loop = threading.Event(), asyncio.get_running_loop()
    loop.set_default_executor(ThreadPoolExecutor(1))
    other = loop.run_in_executor(None, free.wait)
    try:
        yield other
    finally:
        free.set()
        await other
