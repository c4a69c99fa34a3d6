"""From mavsdk's threads to the event loop: bounded, newest telemetry only, at most one wake-up under way."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from typing import Final, NamedTuple

_TURN_BUDGET_S: Final = 0.004
"""The longest that one turn of the loop spends on messages."""


class Letter(NamedTuple):
    """A message as received. `received_s` is monotonic."""

    name: str
    body: str
    received_s: float


class Mailbox:
    """One vehicle's messages on their way to the loop.

    A message with a slot replaces the undelivered one of that slot and keeps its place; all others queue up. When
    `capacity` letters wait, new ones are dropped and counted in `overflowed`.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, deliver: Callable[[Letter], None], *, capacity: int) -> None:
        self._loop = loop
        self._deliver = deliver
        self._capacity = capacity
        self._lock = threading.Lock()
        self._waiting: dict[str | int, Letter] = {}
        self._posted = 0
        self._awake = False
        self._closed = False
        self.overflowed = 0

    def post(self, name: str, body: str, slot: str | None = None) -> None:
        """Hand a message over. From any thread; never blocks."""
        letter = Letter(name, body, time.monotonic())
        with self._lock:
            if self._closed or not self._take(letter, slot):
                return
            wake, self._awake = not self._awake, True
        if wake:
            self._wake()

    def close(self) -> None:
        """Drop what waits and take no more. Idempotent."""
        with self._lock:
            self._closed = True
            self._waiting.clear()

    def _take(self, letter: Letter, slot: str | None) -> bool:
        self._posted += 1
        key = self._posted if slot is None else slot
        if key not in self._waiting and len(self._waiting) >= self._capacity:
            self.overflowed += 1
            return False
        self._waiting[key] = letter
        return True

    def _wake(self) -> None:
        try:
            self._loop.call_soon_threadsafe(self._drain)
        except RuntimeError:  # the loop has ended before close()
            self.close()

    def _drain(self) -> None:
        until_s = time.monotonic() + _TURN_BUDGET_S
        try:
            while (letter := self._next()) is not None:
                self._deliver(letter)
                if time.monotonic() >= until_s:
                    break
        finally:  # a listener's error must not stop the rest
            with self._lock:
                self._awake = bool(self._waiting)
                again = self._awake
            if again:
                self._loop.call_soon(self._drain)

    def _next(self) -> Letter | None:
        with self._lock:
            if not self._waiting:
                return None
            return self._waiting.pop(next(iter(self._waiting)))
