"""Vehicles are set up a few at a time, and one that is silent or does not answer keeps no other waiting for good."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import cast

from app.domain.errors import LinkTimeoutError
from app.vehicles.facts import FactReader
from app.vehicles.link_watch import LinkWatch
from app.vehicles.stream_rates import SET_UP_AT_ONCE, LinkSetup, StreamRates

MANY = 3 * SET_UP_AT_ONCE
SOON_S = 5.0


class Vehicle:
    """What LinkSetup needs of one: it answers once `answers` is set, or never."""

    gripper = None

    def __init__(self, turns: asyncio.Semaphore, *, lost: bool = False, fails: bool = False) -> None:
        self.lost = lost
        self.fails = fails
        self.answers = asyncio.Event()
        self.asked = self.is_done = False
        self.setup = LinkSetup(cast(StreamRates, self), cast(FactReader, _Facts()), cast(LinkWatch, self), turns)

    async def set_all(self) -> None:
        self.asked = True
        if self.fails:
            raise LinkTimeoutError("no answer")
        await self.answers.wait()

    def look_at(self, *_found: object) -> None:
        self.is_done = True


class _Facts:
    limits_read = True

    async def read(self) -> None:
        """Nothing is waited for."""

    def gripper(self) -> None:
        """It has none."""

    def has_gripper_output(self) -> bool:
        return False


@asynccontextmanager
async def begun(*vehicles: Vehicle) -> AsyncIterator[None]:
    """All are found at the same moment."""
    for vehicle in vehicles:
        vehicle.setup.begin()
    try:
        yield
    finally:
        for vehicle in vehicles:
            await vehicle.setup.close()


async def until_done(*vehicles: Vehicle) -> None:
    """Until all of them are set up."""
    async with asyncio.timeout(SOON_S):
        while not all(vehicle.is_done for vehicle in vehicles):
            await asyncio.sleep(0)


async def test_of_many_vehicles_a_few_are_asked_and_the_next_when_one_is_done() -> None:
    turns = asyncio.Semaphore(SET_UP_AT_ONCE)
    vehicles = [Vehicle(turns) for _ in range(MANY)]
    async with begun(*vehicles):
        for done in range(MANY - SET_UP_AT_ONCE):
            async with asyncio.timeout(SOON_S):
                while sum(vehicle.asked for vehicle in vehicles) < SET_UP_AT_ONCE + done:
                    await asyncio.sleep(0)
            assert sum(vehicle.asked and not vehicle.is_done for vehicle in vehicles) == SET_UP_AT_ONCE
            vehicles[done].answers.set()
            await until_done(vehicles[done])
        for vehicle in vehicles:
            vehicle.answers.set()
        await until_done(*vehicles)


async def test_vehicles_that_are_silent_or_do_not_answer_keep_no_turn() -> None:
    turns = asyncio.Semaphore(SET_UP_AT_ONCE)
    silent = [Vehicle(turns, lost=True) for _ in range(MANY)]
    deaf = [Vehicle(turns, fails=True) for _ in range(MANY)]
    last = Vehicle(turns)
    last.answers.set()
    async with begun(*silent, *deaf, last):
        await until_done(last)
        assert not any(vehicle.asked for vehicle in silent)
