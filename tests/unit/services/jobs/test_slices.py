"""However many jobs wait, the desk holds the loop up for no more than one look at the vehicles."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.domain.vehicle.state import LandedState
from tests.support.job_fleet import Yard, a_yard

VEHICLES = 12
JOBS = 60


class LooksPerTurn:
    """How often vehicles are asked for their state within one turn of the loop, at most."""

    def __init__(self, yard: Yard) -> None:
        self._yard = yard
        self.most = 0
        self.turns = 0

    def _looks(self) -> int:
        return sum(vehicle.looks for vehicle in self._yard.vehicles)

    async def watch(self) -> None:
        """Until it is cancelled."""
        before = self._looks()
        while True:
            await asyncio.sleep(0)
            now = self._looks()
            self.most, before, self.turns = max(self.most, now - before), now, self.turns + 1


@asynccontextmanager
async def watched(yard: Yard) -> AsyncIterator[LooksPerTurn]:
    looks = LooksPerTurn(yard)
    task = asyncio.create_task(looks.watch())
    try:
        yield looks
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def test_a_pass_looks_at_the_vehicles_once_however_many_jobs_wait_for_one_that_is_not_ready() -> None:
    async with a_yard(VEHICLES) as yard:
        yard.vehicles[1].put(landed=LandedState.IN_AIR)
        for _ in range(JOBS):
            await yard.order(vehicle="v2")
        async with watched(yard) as looks:
            await yard.until(lambda: looks.turns > 0, "the watch must have begun")
            begun = yard.vehicles[0].looks
            await yard.until(lambda: yard.vehicles[0].looks > begun + 20, "the desk must look again and again")
            turns = looks.turns
            await yard.until(lambda: looks.turns > turns + 1, "the turn of that look must be counted")
        assert looks.most <= 2 * VEHICLES, "a look at every vehicle for every job stops the loop"


async def test_a_look_at_candidates_asks_few_vehicles_for_their_facts_in_one_turn() -> None:
    async with a_yard(VEHICLES) as yard:
        asked = most = before = 0
        read = yard.fleet.facts

        async def counted(vehicle_id: str, *, fresh: bool = False) -> object:
            nonlocal asked
            asked += 1
            return await read(vehicle_id, fresh=fresh)

        yard.fleet.facts = counted  # type: ignore[method-assign,assignment]

        async def watch() -> None:
            nonlocal most, before
            while True:
                await asyncio.sleep(0)
                most, before = max(most, asked - before), asked

        task = asyncio.create_task(watch())
        await yard.order(vehicle="any", min_battery_percent=100)
        task.cancel()
        assert asked >= VEHICLES
        assert most <= VEHICLES // 2, "a hundred vehicles at once stop the loop"


async def test_the_queues_are_shown_with_what_each_vehicle_may_get_in_order() -> None:
    async with a_yard(3) as yard:
        for vehicle in yard.vehicles:
            vehicle.put(landed=LandedState.IN_AIR)
        first = await yard.order(vehicle="v2")
        second = await yard.order(vehicle="any", priority=5)
        third = await yard.order(vehicle="any", allowed_vehicles=["v1", "v2"])
        shown = await yard.jobs.queues()
        assert [job.id for job in shown.waiting] == [second.id, first.id, third.id]
        assert [view.waiting for view in shown.vehicles] == [
            (second.id, third.id),
            (second.id, first.id, third.id),
            (second.id,),
        ]
