"""What a message of a vehicle costs until a listener has it, through the link guard; the floor is mavsdk alone."""

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
async def prepared(scale: Scale) -> AsyncIterator[Round]:
    """Vehicles in a process of their own for each half of a round."""

    async def cost_us(way: str) -> float:
        found = Measured()
        await measure(way, VEHICLES, RATE, LONG_S if scale.long else SHORT_S, found)
        return found.cost_us

    async def round_() -> Pair:
        return Pair(ours=await cost_us("guard"), floor=await cost_us("mavsdk alone"))

    yield round_


ROWS: Final = (
    Row(
        name="guard",
        title=f"a message through the link guard, {VEHICLES} vehicles with {RATE:g}/s each",
        floor="mavsdk without a guard",
        unit="us CPU",
        goal=Goal(2.0, "at most"),
        prepare=prepared,
        limited_by="the guard's turn on the event loop for each datagram: receive, judge, send on",
        rounds=3,
        long_rounds=9,
    ),
)
