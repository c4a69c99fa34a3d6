"""The offboard websocket: frames and their answers, and that its end is the end of the lease."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import aiohttp

from tests.support.offboard_api import PATH
from tests.support.service_in_process import Service


@dataclass
class Pilot:
    """One client of the socket."""

    socket: aiohttp.ClientWebSocketResponse

    async def send(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Send a frame with an id, and wait for the answer with that id."""
        await self.socket.send_json({"type": kind, "id": 7, **fields})
        return await self.answer()

    async def answer(self) -> dict[str, Any]:
        """The next frame that is told because it was asked for."""
        while (frame := await self.frame())["type"] in ("state", "tasks"):
            pass
        return frame

    async def frame(self) -> dict[str, Any]:
        frame: dict[str, Any] = await self.socket.receive_json(timeout=60)
        return frame

    async def state(self, state: str) -> dict[str, Any]:
        """The next state frame that says this."""
        while (frame := await self.frame())["type"] != "state" or frame["offboard"]["state"] != state:
            pass
        return dict(frame["offboard"])

    async def close_code(self) -> int | None:
        while not (await self.socket.receive(timeout=60)).type.name.startswith("CLOS"):
            pass
        return self.socket.close_code


@asynccontextmanager
async def pilot(service: Service, path: str = PATH, **options: Any) -> AsyncIterator[Pilot]:
    async with service.http.ws_connect(service.url + path, **options) as socket:
        yield Pilot(socket)
