"""What a vehicle sends, decoded on the loop and given to those who want that message."""

from __future__ import annotations

import asyncio
import logging
import re
from collections import defaultdict
from collections.abc import Callable
from typing import Any, Final, TypeVar

from app.vehicles.decoders import DECODERS, decode
from app.vehicles.mailbox import Letter, Mailbox

M = TypeVar("M")
_log = logging.getLogger(__name__)

TELEMETRY: Final = frozenset(
    {"GLOBAL_POSITION_INT", "HOME_POSITION", "SYS_STATUS", "SYSTEM_TIME", "MISSION_REQUEST", "MISSION_REQUEST_INT"}
)
"""Only the newest matters. BATTERY_STATUS and SERVO_OUTPUT_RAW come for several batteries and ports, so they queue."""


_PARAM_ID: Final = re.compile(r'"param_id"\s*:\s*"([^"]*)"')


class Inbox:
    """Handlers are called on the loop in the order of their registration, with the message and its arrival time.

    Of PARAM_VALUE the newest of each name in `parameters` is let in: another station may have all of a thousand listed.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, *, capacity: int) -> None:
        self._handlers: defaultdict[type[Any], list[Callable[[Any, float], None]]] = defaultdict(list)
        self._mailbox = Mailbox(loop, self._deliver, capacity=capacity)
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

    def _deliver(self, letter: Letter) -> None:
        try:
            message = decode(letter.name, letter.body)
        except ValueError as error:
            self.unreadable += 1
            _log.warning("unreadable message: %s", error)
            return
        for handler in tuple(self._handlers[type(message)]):
            handler(message, letter.received_s)
