"""Follows the service's websocket across cut connections: every event once, in order."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Any, Final

import aiohttp

from app.cli.exit_status import ServerRefusedError, ServerUnreachableError
from app.cli.service_client import ServiceClient
from app.domain.events import Event

FIRST_PAUSE_S: Final = 0.2
LONGEST_PAUSE_S: Final = 5.0


@dataclass(frozen=True, slots=True)
class StreamCut:
    """The connection is gone; it is being made again."""

    reason: str


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All vehicles and open runs as of event `seq`, after every connect."""

    seq: int
    vehicles: list[dict[str, Any]]
    runs: list[dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Telemetry:
    """The newest state of the vehicles that changed, by vehicle id."""

    states: dict[str, dict[str, Any]]


_FINAL_CLOSES: Final = {
    4400: "the service does not take this place in the stream",
    4401: "the service wants a valid token",
    4409: "the service's journal is another one than before",
}
"""Close codes after which connecting again cannot help."""

StreamItem = Event | Snapshot | Telemetry | StreamCut


class EventStream:
    """`seq` is the newest event seen. A stream that stays away for `patience_s` raises ServerUnreachableError."""

    def __init__(self, client: ServiceClient, *, after: int | None = None, patience_s: float = 60.0) -> None:
        self._client = client
        self._patience_s = patience_s
        self.seq = after

    async def items(self) -> AsyncIterator[StreamItem]:
        """Everything from now on (or from `after`), without end."""
        loop = asyncio.get_running_loop()
        away_since: float | None = None
        pause_s = FIRST_PAUSE_S
        while True:
            try:
                socket = await self._client.websocket("/stream" + ("" if self.seq is None else f"?after={self.seq}"))
            except ServerUnreachableError:
                if away_since is None or loop.time() - away_since >= self._patience_s:
                    raise  # the very first connect is not tried again: the address may be wrong
                await asyncio.sleep(pause_s)
                pause_s = min(LONGEST_PAUSE_S, pause_s * 2)
                continue
            async with socket:
                pause_s = FIRST_PAUSE_S
                async for item in self._read(socket):
                    yield item
                    away_since = None
            _refuse_final_close(socket)
            away_since = away_since or loop.time()
            yield StreamCut(f"close code {socket.close_code}")
            await asyncio.sleep(pause_s)

    async def _read(self, socket: aiohttp.ClientWebSocketResponse) -> AsyncIterator[StreamItem]:
        async for message in socket:
            if message.type is not aiohttp.WSMsgType.TEXT:
                continue
            item = self._parsed(json.loads(message.data))
            if item is not None:
                yield item

    def _parsed(self, frame: dict[str, Any]) -> StreamItem | None:
        kind = frame.get("type")
        if kind == "event":
            event = Event.model_validate(frame["event"])
            if self.seq is not None and event.seq <= self.seq:
                return None  # seen before the cut
            self.seq = event.seq
            return event
        if kind == "hello" and self.seq is None:
            self.seq = int(frame["seq"])  # without `after`, the events after this one come
        if kind == "snapshot":
            return Snapshot(int(frame["seq"]), frame["vehicles"], frame["runs"])
        if kind == "telemetry":
            return Telemetry(frame["vehicles"])
        return None


def _refuse_final_close(socket: aiohttp.ClientWebSocketResponse) -> None:
    code = socket.close_code
    if code in _FINAL_CLOSES:
        raise ServerRefusedError("stream.closed", f"{_FINAL_CLOSES[code]} (close code {code})", status=code)
