"""The control socket of a simulator that answers what a test says."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

HEALTHY: dict[str, Any] = {
    "type": "quad",
    "latitude_deg": 47.4,
    "longitude_deg": 8.5,
    "height_m": 0.0,
    "ground_speed_m_s": 0.0,
    "armed": False,
    "mode": "LOITER",
    "landed_state": "ON_GROUND",
    "mission_seq": 0,
    "gripper_open": False,
    "time_s": 12.5,
    "faults": {},
}


class ScriptedSimulator:
    """`answer_to_faults` is sent to every order; None: it says nothing, bytes: as they are. `orders` came in.

    An order of a speed that is answered with ok changes `speed`.
    """

    def __init__(self, *system_ids: int) -> None:
        self.vehicles = [{"vehicle": number, **HEALTHY} for number in system_ids]
        self.answer_to_faults: dict[str, Any] | bytes | None = {"ok": True}
        self.orders: list[dict[str, Any]] = []
        self.speed: dict[str, Any] = {"wanted": 1.0, "achieved": 1.0, "behind": False}
        self.port = 0
        self._clients: set[asyncio.StreamWriter] = set()

    @asynccontextmanager
    async def running(self) -> AsyncIterator[ScriptedSimulator]:
        """Listens on a free port; then everybody is cut off."""
        server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        try:
            yield self
        finally:
            server.close()
            for writer in self._clients:
                writer.close()
            await server.wait_closed()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._clients.add(writer)
        while line := await reader.readline():
            request = json.loads(line)
            answer: dict[str, Any] | bytes | None = {"ok": True, "vehicles": self.vehicles, "speed": self.speed}
            if "query" not in request:
                self.orders.append(request)
                answer = self.answer_to_faults
            if "speed" in request and answer == {"ok": True}:
                self.speed = {"wanted": request["speed"], "achieved": None, "behind": False}
                answer = {"ok": True, "speed": self.speed}
            if answer is not None:
                writer.write(answer if isinstance(answer, bytes) else json.dumps(answer).encode() + b"\n")
        writer.close()
        self._clients.discard(writer)
