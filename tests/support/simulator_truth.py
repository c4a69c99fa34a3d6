"""What simulated vehicles really did, as their control socket tells it many times a second."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any, Final

from app.domain.geo import LocalProjection
from tests.support.plan_pieces import HOME

LOOK_EVERY_S: Final = 0.05
_HERE: Final = LocalProjection(HOME.latitude_deg, HOME.longitude_deg)


@dataclass
class Truth:
    """One vehicle. `modes`: those that it was armed in since `forget`, one after the other. `releases` since then.

    A release is a gripper that opens, or a winch that puts its parcel down.
    """

    armed: bool = False
    mode: str = ""
    modes: list[str] = field(default_factory=list)
    releases: int = 0
    release: dict[str, Any] | None = None
    """The look that saw the newest one, with its place."""
    is_released: bool = False
    flights: int = 0
    """How often it was armed, ever."""
    north_m: float = 0.0
    height_m: float = 0.0
    speed_m_s: float = 0.0
    at_s: float = 0.0

    def see(self, state: dict[str, Any]) -> None:
        """The next look."""
        is_released = bool(state["gripper_open"] or state["winch_delivered"])
        self.north_m = _HERE.to_local(state["latitude_deg"], state["longitude_deg"])[1]
        self.flights += state["armed"] and not self.armed
        if is_released and not self.is_released and self.at_s > 0:
            self.releases, self.release = self.releases + 1, {**state, "north_m": self.north_m}
        self.armed, self.mode, self.is_released = state["armed"], state["mode"], is_released
        self.height_m, self.speed_m_s, self.at_s = state["height_m"], state["ground_speed_m_s"], time.monotonic()
        if self.armed and self.modes[-1:] != [self.mode]:
            self.modes.append(self.mode)

    def forget(self) -> None:
        """Another flight begins."""
        self.forget_modes()
        self.releases, self.release = 0, None

    def forget_modes(self) -> None:
        """From here on its modes count."""
        self.modes = []


class Truths:
    """All vehicles of a simulator, by system id."""

    def __init__(self) -> None:
        self.by_id: dict[int, Truth] = {}
        self.looks = 0

    async def look(self, port: int) -> None:
        """Until it is cancelled."""
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        try:
            while True:
                writer.write(b'{"query": "state"}\n')
                for state in json.loads(await reader.readline())["vehicles"]:
                    self.by_id.setdefault(state["vehicle"], Truth()).see(state)
                self.looks += 1
                await asyncio.sleep(LOOK_EVERY_S)
        finally:
            writer.close()


@asynccontextmanager
async def watched_truth(port: int) -> AsyncIterator[Truths]:
    """Watch the simulator with this control port while the block runs."""
    truths = Truths()
    task = asyncio.create_task(truths.look(port), name=f"truth of {port}")
    try:
        async with asyncio.timeout(30):
            while not truths.looks and not task.done():
                await asyncio.sleep(LOOK_EVERY_S)
        yield truths
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
