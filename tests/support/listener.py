"""A client of the stream, for tests."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import aiohttp

from app.domain.events.vehicle import VehicleStatusText
from tests.support.service_in_process import Service


@dataclass
class Listener:
    """One client of the stream."""

    socket: aiohttp.ClientWebSocketResponse
    early: deque[dict[str, Any]] = field(default_factory=deque)

    async def next_frame(self) -> dict[str, Any]:
        """The next frame, whatever it is."""
        if self.early:
            return self.early.popleft()
        frame: dict[str, Any] = await self.socket.receive_json()
        return frame

    async def greeted(self) -> None:
        """Wait for the first frame and keep it: what happens before the hello is not told as an event."""
        async with asyncio.timeout(30):
            first = await self.socket.receive()
        if first.type is aiohttp.WSMsgType.TEXT:
            self.early.append(first.json())

    async def frame(self, *kinds: str) -> dict[str, Any]:
        """The next frame of these types; others are passed over."""
        async with asyncio.timeout(30):
            while True:
                frame = await self.next_frame()
                if frame["type"] in kinds:
                    return frame

    async def event(self) -> dict[str, Any]:
        """The next event."""
        event: dict[str, Any] = (await self.frame("event"))["event"]
        return event

    async def seqs_to(self, last: int) -> list[int]:
        """The numbers of the events that come, until `last`."""
        seen: list[int] = []
        while not seen or seen[-1] < last:
            seen.append((await self.event())["seq"])
        return seen

    async def close_code(self) -> int | None:
        """Read to the end."""
        async with asyncio.timeout(30):
            async for _ in self.socket:
                pass
        return self.socket.close_code


@asynccontextmanager
async def listen(service: Service, query: str = "", **options: Any) -> AsyncIterator[Listener]:
    """Open the stream, and go on when it has said hello (or has been refused)."""
    async with service.http.ws_connect(f"{service.url}/api/v1/stream{query}", **options) as socket:
        listener = Listener(socket)
        await listener.greeted()
        yield listener


async def record(service: Service, count: int, *, size: int = 0) -> list[int]:
    """Record events, a few calls at a time. Their numbers."""
    journal = service.services.journal
    seqs: list[int] = []
    for first in range(0, count, 10):
        events = [
            journal.new_event(VehicleStatusText(severity="info", text=f"{number} {'x' * size}"), vehicle_id="v1")
            for number in range(first, min(first + 10, count))
        ]
        stored = await asyncio.gather(*(journal.record(event) for event in events))
        seqs += [event.seq for one in stored for event in one]
    return seqs
