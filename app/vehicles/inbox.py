"""What a vehicle sends, decoded on the loop and given to those who want that message."""

from __future__ import annotations

import asyncio
import logging
import re
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeVar

from app.vehicles.decoders import DECODERS, decode

# From mavsdk's threads to the event loop: bounded, newest telemetry only, at most one wake-up under way.


_TURN_BUDGET_S: Final = 0.004
"""The longest that one turn of the loop spends on messages."""


Wake = Callable[[Callable[[], None]], object]


class QueuedMessage(NamedTuple):
    """A message as received. `received_s` is monotonic."""

    name: str
    body: str
    received_s: float


class Mailbox:
    """One vehicle's messages on their way to the loop.

    A message with a slot replaces the undelivered one of that slot and keeps its place; all others queue up. When
    `capacity` messages wait, new ones are dropped and counted in `overflowed`. `wake` has a function called
    on the loop.
    """

    def __init__(
        self, loop: asyncio.AbstractEventLoop, deliver: Callable[[QueuedMessage], None], *, capacity: int, wake: Wake
    ) -> None:
        self._loop = loop
        self._wake_loop = wake
        self._deliver = deliver
        self._capacity = capacity
        self._lock = threading.Lock()
        self._waiting: dict[str | int, QueuedMessage] = {}
        self._posted = 0
        self._awake = False
        self._closed = False
        self.overflowed = 0

    def post(self, name: str, body: str, slot: str | None = None) -> None:
        """Hand a message over. From any thread; never blocks."""
        queued = QueuedMessage(name, body, time.monotonic())
        with self._lock:
            if self._closed or not self._take(queued, slot):
                return
            wake, self._awake = not self._awake, True
        if wake:
            self._wake()

    def close(self) -> None:
        """Drop what waits and take no more. Idempotent."""
        with self._lock:
            self._closed = True
            self._waiting.clear()

    def _take(self, queued: QueuedMessage, slot: str | None) -> bool:
        self._posted += 1
        key = self._posted if slot is None else slot
        if key not in self._waiting and len(self._waiting) >= self._capacity:
            self.overflowed += 1
            return False
        self._waiting[key] = queued
        return True

    def _wake(self) -> None:
        try:
            self._wake_loop(self._drain)
        except RuntimeError:  # the loop has ended before close()
            self.close()

    def _drain(self) -> None:
        until_s = time.monotonic() + _TURN_BUDGET_S
        try:
            while (queued := self._next()) is not None:
                self._deliver(queued)
                if time.monotonic() >= until_s:
                    break
        finally:  # a listener's error must not stop the rest
            with self._lock:
                self._awake = bool(self._waiting)
                again = self._awake
            if again:
                self._loop.call_soon(self._drain)

    def _next(self) -> QueuedMessage | None:
        with self._lock:
            if not self._waiting:
                return None
            return self._waiting.pop(next(iter(self._waiting)))


M = TypeVar("M")
_log = logging.getLogger(__name__)

TELEMETRY: Final = frozenset({"GLOBAL_POSITION_INT", "HOME_POSITION", "SYS_STATUS", "SYSTEM_TIME"})
"""Only the newest matters. BATTERY_STATUS and SERVO_OUTPUT_RAW come for several batteries and ports, so they queue."""


_PARAM_ID: Final = re.compile(r'"param_id"\s*:\s*"([^"]*)"')


class Inbox:
    """Handlers are called on the loop in the order of their registration, with the message and its arrival time.

    Of PARAM_VALUE the newest of each name in `parameters` is let in: another station may have all of a thousand listed.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, *, capacity: int, wake: Wake | None = None) -> None:
        """`wake`: the doorbell that many inboxes share, else the loop's own."""
        self._handlers: defaultdict[type[Any], list[Callable[[Any, float], None]]] = defaultdict(list)
        self._mailbox = Mailbox(loop, self._deliver, capacity=capacity, wake=wake or loop.call_soon_threadsafe)
        self.unreadable = 0
        self.parameters: set[str] = set()

    names = tuple(DECODERS)

    @property
    def overflowed(self) -> int:
        """Messages dropped because the loop did not keep up."""
        return self._mailbox.overflowed

    def post(self, name: str, body: str) -> None:
        """Hand over from any thread."""
        slot = name if name in TELEMETRY else None
        if name == "PARAM_VALUE" and (found := _PARAM_ID.search(body)) is not None:
            if found[1] not in self.parameters:
                return
            slot = f"{name} {found[1]}"
        self._mailbox.post(name, body, slot=slot)

    def on(self, kind: type[M], handler: Callable[[M, float], None]) -> Callable[[], None]:
        """Call `handler` for each message of this type until the returned function is called."""
        handlers = self._handlers[kind]
        handlers.append(handler)

        def end() -> None:
            if handler in handlers:
                handlers.remove(handler)

        return end

    def close(self) -> None:
        """Deliver nothing more."""
        self._mailbox.close()

    def _deliver(self, queued: QueuedMessage) -> None:
        try:
            message = decode(queued.name, queued.body)
        except ValueError as error:
            self.unreadable += 1
            _log.warning("unreadable message: %s", error)
            return
        for handler in tuple(self._handlers[type(message)]):
            handler(message, queued.received_s)
