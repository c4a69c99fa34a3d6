"""What waits for one socket: events in order within a bound, and the newest telemetry."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from pydantic_core import to_json

from app.api.stream.frames import CloseCode, text_frame


@dataclass(frozen=True)
class Tick:
    """One look at the vehicles: each one's state as JSON. The frame is made once, for all sockets that take it."""

    time: float
    states: Mapping[str, bytes]

    @cached_property
    def frame(self) -> bytes:
        """The telemetry frame."""
        inner = b",".join(to_json(vehicle_id) + b":" + state for vehicle_id, state in self.states.items())
        return text_frame(b'{"type":"telemetry","time":' + to_json(self.time) + b',"vehicles":{' + inner + b"}}")

    def over(self, older: Tick) -> Tick:
        """This tick, with what it does not have from an older one that was never sent."""
        if older.states.keys() <= self.states.keys():
            return self
        return Tick(self.time, {**older.states, **self.states})


class Outbox:
    """Filled by the broadcast, emptied by the socket's writer. `ended` has the code once the socket must be closed."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._after = 0
        self._events: deque[bytes] = deque()
        self._tick: Tick | None = None
        self._filled = asyncio.Event()
        self.ended: asyncio.Future[CloseCode] = asyncio.get_running_loop().create_future()

    def begin_after(self, seq: int) -> None:
        """Events up to `seq` were sent already: leave them out."""
        self._after = seq

    def end(self, code: CloseCode) -> None:
        """Close the socket with `code`; what still waits is dropped. The first call counts."""
        if not self.ended.done():
            self.ended.set_result(code)
        self._events.clear()

    def offer_event(self, seq: int, frame: bytes) -> None:
        """Put an event in. One that does not fit ends the socket: none may be left out."""
        if seq <= self._after or self.ended.done():
            return
        if len(self._events) >= self._capacity:
            self.end(CloseCode.TOO_SLOW)
            return
        self._events.append(frame)
        self._filled.set()

    def offer_tick(self, tick: Tick) -> None:
        """Put telemetry in, over what was not sent yet."""
        self._tick = tick if self._tick is None else tick.over(self._tick)
        self._filled.set()

    async def take(self) -> list[bytes]:
        """All frames that wait, events first. Waits for one."""
        await self._filled.wait()
        self._filled.clear()
        frames = list(self._events)
        self._events.clear()
        if self._tick is not None:
            frames.append(self._tick.frame)
            self._tick = None
        return frames
