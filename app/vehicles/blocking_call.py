"""A call that blocks, on a thread that cannot keep the process from ending.

Not the default executor: its threads are joined at exit, and a mavsdk call cut off by destroy() never returns.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable
from typing import TypeVar

from app.domain.errors import LinkError
from app.vehicles.future_result import settle_from_thread

T = TypeVar("T")
_log = logging.getLogger(__name__)


class BlockingCall:
    """Runs one blocking call at a time."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._turn = asyncio.Lock()
        self._under_way: asyncio.Future[None] | None = None
        self._closed = False

    async def run(self, call: Callable[[], T]) -> T:
        """The call's result or its LinkError. Cancelling the waiter does not stop the call."""
        async with self._turn:
            if self._closed:
                raise LinkError("the link is closed")
            ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
            outcome: list[T | LinkError] = []

            def body() -> None:
                try:
                    outcome.append(call())
                except LinkError as error:
                    outcome.append(error)
                settle_from_thread(ended, None)

            self._under_way = ended
            threading.Thread(target=body, name=self._name, daemon=True).start()
            await asyncio.shield(ended)
        if isinstance(outcome[0], LinkError):
            raise outcome[0]
        return outcome[0]

    async def close(self, *, timeout_s: float) -> None:
        """Start none any more, and wait for the one under way."""
        self._closed = True
        if self._under_way is None or self._under_way.done():
            return
        _, pending = await asyncio.wait({self._under_way}, timeout=timeout_s)
        if pending:
            _log.error("a blocking call did not end in %.1f s; its thread is given up", timeout_s)
