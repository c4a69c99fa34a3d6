"""A pilot at the offboard websocket, and the simulated vehicle as it truly is."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import aiohttp

from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet

SEND_EVERY_S = 0.05
ANSWER_S = 30.0
"""It ends a hang."""
PLAN = json.loads((PLANS / "clinic-run.json").read_text())


class Pilot:
    """Says the same setpoint twenty times a second, and keeps what it is told."""

    def __init__(self, wire: aiohttp.ClientWebSocketResponse) -> None:
        self.wire = wire
        self.setpoint: dict[str, Any] = {"type": "velocity_ned", "north_m_s": 3.0, "east_m_s": 0.0}
        self.offboard: dict[str, Any] = {}
        self.answers: list[dict[str, Any]] = []
        self._tasks = [asyncio.create_task(self._send_setpoints()), asyncio.create_task(self._receive())]

    async def do(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Ask for something, and wait for its answer."""
        number = 100 + len(self.answers)
        await self.wire.send_json({"type": kind, "id": number, **fields})
        await until(
            self._closed, lambda closed: closed or self._answer_to(number) is not None, f"{kind} must be answered", 30
        )
        answer = self._answer_to(number)
        assert answer, f"{kind}: the socket was closed with {self.wire.close_code}: {self.offboard}"
        return answer

    async def enter(self) -> None:
        """The lease, then OFFBOARD mode."""
        assert (await self.do("acquire_lease"))["type"] == "lease_granted"
        answer = await self.do("enter")
        assert answer["type"] == "done", answer

    async def until_closed(self) -> int | None:
        """Wait for the service to close the socket."""
        async with asyncio.timeout(30):
            await asyncio.wait({self._tasks[1]})
        return self.wire.close_code

    def fall_silent(self) -> None:
        """Say nothing any more; the socket stays open."""
        self._tasks[0].cancel()

    async def leave(self) -> None:
        """Close the socket."""
        for task in self._tasks:
            task.cancel()
        await self.wire.close()

    async def _closed(self) -> bool:
        return self._tasks[1].done()

    def _answer_to(self, number: int) -> dict[str, Any] | None:
        return next((answer for answer in self.answers if answer.get("id") == number), None)

    async def _send_setpoints(self) -> None:
        with suppress(ConnectionError):
            while not self.wire.closed:
                await self.wire.send_json({"type": "setpoint", "setpoint": self.setpoint})
                await asyncio.sleep(SEND_EVERY_S)

    async def _receive(self) -> None:
        async for message in self.wire:
            frame = json.loads(message.data)
            if frame["type"] == "state":
                self.offboard = frame["offboard"]
            elif frame["type"] != "setpoint_ack":
                self.answers.append(frame)


@asynccontextmanager
async def pilot(http: aiohttp.ClientSession, url: str) -> AsyncIterator[Pilot]:
    """A pilot of vehicle v1."""
    async with http.ws_connect(f"{url}/api/v1/vehicles/v1/offboard") as wire:
        found = Pilot(wire)
        try:
            yield found
        finally:
            await found.leave()


async def paused_in_the_air(dispatcher: Dispatcher, plan: Any = PLAN) -> str:
    """A run that a person has paused on its way."""
    await dispatcher.until_vehicles(1)
    run_id = await dispatcher.fly(plan, "v1")
    await until(
        lambda: dispatcher.get("/vehicles/v1"),
        lambda v: (v["state"]["relative_altitude_m"] or 0.0) > 10.0,
        "it must climb",
        60,
    )
    await dispatcher.post(f"/runs/{run_id}/pause")
    await dispatcher.until_run(run_id, lambda run: run["state"] == "paused", "it must pause", 20)
    return run_id


async def truth(fleet: SimulatedFleet) -> dict[str, Any]:
    """The first vehicle, asked past Waydrop: its control socket answers while Waydrop is stopped."""
    return await asyncio.to_thread(_truth, fleet.control_port)


def _truth(port: int) -> dict[str, Any]:
    with socket.create_connection(("127.0.0.1", port), ANSWER_S) as connection:
        connection.sendall(b'{"query": "state"}\n')
        with connection.makefile("rb") as lines:
            vehicle: dict[str, Any] = json.loads(lines.readline())["vehicles"][0]
    return vehicle
