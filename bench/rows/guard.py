"""What a message of a vehicle costs until a listener has it: without the link guard, and through it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from bench.link_guard import Measured, measure
from bench.row import Goal, Pair, Round, Row, Scale

VEHICLES: Final = 5
RATE: Final = 150.0
SHORT_S, LONG_S = 2.0, 6.0
"""Of each half of a round."""


@asynccontextmanager
async def prepared(scale: Scale, ours: str, floor: str) -> AsyncIterator[Round]:
    """Vehicles in a process of their own for each half of a round."""

    async def cost_us(way: str) -> float:
        found = Measured()
        await measure(way, VEHICLES, RATE, LONG_S if scale.long else SHORT_S, found)
        return found.cost_us

    async def round_() -> Pair:
        return Pair(ours=await cost_us(ours), floor=await cost_us(floor))

    yield round_


ROWS: Final = (
    Row(
        name="telemetry",
        title=f"a message from mavsdk to its listener, {VEHICLES} vehicles with {RATE:g}/s each",
        floor="mavsdk's callback, which keeps the newest",
        unit="us CPU",
        goal=Goal(1.3, "at most"),
        prepare=lambda scale: prepared(scale, "mavsdk alone", "slots"),
        limited_by="mavsdk itself, which makes JSON of each message, and the turn on the event loop",
        rounds=3,
        long_rounds=9,
    ),
    Row(
        name="guard",
        title="the same message through the link guard",
        floor="mavsdk without a guard",
        unit="us CPU",
        goal=Goal(2.0, "at most"),
        prepare=lambda scale: prepared(scale, "guard", "mavsdk alone"),
        limited_by="the guard's turn on the event loop for each datagram: receive, judge, send on",
        rounds=3,
        long_rounds=9,
    ),
)
