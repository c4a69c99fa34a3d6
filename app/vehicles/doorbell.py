"""Wakes the event loop from other threads, once for all that want to be called when it looks."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final

Call = Callable[[], object]

_TURN_BUDGET_S: Final = 0.004
"""The longest that one turn of the loop spends on calls."""


class Doorbell:
    """Made on the event loop; it wakes that one until `close`, which comes after the last `ring` of any thread.

    call_soon_threadsafe writes to a socket for each call, and the loop then reads until the socket is empty. Here only
    the first call of a turn writes, and an eventfd is read once. See docs/decisions/0038.
    """

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._calls: deque[Call] = deque()
        self._rung = False
        self._eventfd: int | None = None
        if sys.platform == "linux":
            self._eventfd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
            self._loop.add_reader(self._eventfd, self._ready)

    def ring(self, call: Call) -> None:
        """Have `call` called on the loop, after those that came before it. From any thread; never blocks.

        Raises RuntimeError, where the system has no eventfd: the loop has ended.
        """
        with self._lock:
            self._calls.append(call)
            first, self._rung = not self._rung, True
        if first:
            self._wake()

    def close(self) -> None:
        """Call nothing more. Idempotent."""
        with self._lock:
            self._calls.clear()
        if sys.platform == "linux" and self._eventfd is not None:
            self._loop.remove_reader(self._eventfd)
            os.close(self._eventfd)
            self._eventfd = None

    def _wake(self) -> None:
        if sys.platform == "linux" and self._eventfd is not None:
            os.eventfd_write(self._eventfd, 1)
        else:
            self._loop.call_soon_threadsafe(self._answer)

    def _ready(self) -> None:
        if sys.platform == "linux" and self._eventfd is not None:
            os.eventfd_read(self._eventfd)
        self._answer()

    def _answer(self) -> None:
        until_s = time.monotonic() + _TURN_BUDGET_S
        try:
            while (call := self._next()) is not None:
                call()
                if time.monotonic() >= until_s:
                    break
        finally:  # an error of one must not stop the rest
            with self._lock:
                self._rung = bool(self._calls)
                again = self._rung
            if again:
                self._loop.call_soon(self._answer)

    def _next(self) -> Call | None:
        with self._lock:
            return self._calls.popleft() if self._calls else None
