"""What work costs as it grows: a plan with its items, an event with its readers, a message with the vehicles on a port.

Usage: python -m bench.scaling

Prints the CPU time of this process, or of the service. Exit status 1 if something grew faster than what there is of
it; bench/growth.py does the same for the journal.
"""

from __future__ import annotations

import asyncio
import json
import sys
import tempfile
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing
from itertools import pairwise
from pathlib import Path
from typing import Final

from bench.link_guard import Measured, measure
from bench.rows.fanout import cpu_s, waydrop
from bench.rows.plan import checking, cpu_ms, survey
from bench.rows.vehicles import of_service
from bench.table import print_line
from tests.support.simulated import SimulatedFleet

ITEMS: Final = (10, 100, 990)
SOCKETS: Final = (1, 10, 100, 1000)
VEHICLES: Final = (1, 10, 30)
"""On one port, each with an inbox alone."""
FLEETS: Final = (1, 10, 100)
"""On one port, of a whole service."""
TIMES: Final = 7
EVENTS: Final = 300
MESSAGES_PER_S: Final = 5.0
"""Of each vehicle, as at low rates."""
SECONDS: Final = 4.0
SLACK: Final = 1.5
"""How much more than its share a step may take."""
Step = tuple[int, float]


async def plans() -> AsyncGenerator[Step, None]:
    """Milliseconds for one plan: parse, check, predict, compile."""
    for items in ITEMS:
        work = checking(json.dumps(survey(items)).encode())
        yield items, min(cpu_ms(work) for _ in range(TIMES))


async def events() -> AsyncGenerator[Step, None]:
    """Milliseconds for one event, until all readers have it."""
    for sockets in SOCKETS:
        with tempfile.TemporaryDirectory() as folder:
            async with waydrop(Path(folder), sockets) as server:
                found = [await cpu_s(server, EVENTS, 1, turn) for turn in range(1, TIMES + 1)]
        yield sockets, min(found) / EVENTS * 1e3


async def fleets() -> AsyncGenerator[Step, None]:
    """Milliseconds of the whole service for one second of a fleet on one port, at low rates."""
    for vehicles in FLEETS:
        with SimulatedFleet(",".join(["quad"] * vehicles), shared_port=True) as fleet:
            found = await of_service(fleet.connections[0], vehicles)
        yield vehicles, found.cores * 1e3


async def messages() -> AsyncGenerator[Step, None]:
    """Milliseconds for one second of all vehicles, through the link guard."""
    for vehicles in VEHICLES:
        found = Measured()
        await measure("guard", vehicles, MESSAGES_PER_S, SECONDS, found, one_port=True)
        yield vehicles, found.cost_us * MESSAGES_PER_S * vehicles / 1e3


CURVES: Final[tuple[tuple[str, str, Callable[[], AsyncGenerator[Step, None]]], ...]] = (
    ("a plan", "items", plans),
    ("an event", "sockets", events),
    ("a second of messages", "vehicles", messages),
    ("a second of a fleet", "vehicles", fleets),
)


async def main() -> int:
    """The exit status."""
    failed = False
    for work, grows, curve in CURVES:
        steps = []
        async with aclosing(curve()) as found:
            async for size, cost in found:
                steps.append((size, cost))
                print_line(f"{work:22}{size:>6,} {grows:9}{cost:>10,.2f} ms")
        for (small, little), (large, much) in pairwise(steps):
            if much > little * large / small * SLACK:
                print_line(f"{work}: from {small} to {large} {grows} it grew faster than they did")
                failed = True
    return int(failed)


if __name__ == "__main__":
    sys.exit(asyncio.run(main()))
