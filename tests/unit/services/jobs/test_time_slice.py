"""However many jobs wait, the scheduler holds the loop up for no more than one poll of the vehicles."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.domain.vehicle.state import LandedState
from tests.support.job_service import JobService, job_service

VEHICLES = 12
JOBS = 60


class LooksPerTurn:
    """How often vehicles are asked for their state within one turn of the loop, at most."""

    def __init__(self, service: JobService) -> None:
        self._service = service
        self.most = 0
        self.turns = 0

    def _looks(self) -> int:
        return sum(vehicle.looks for vehicle in self._service.vehicles)

    async def watch(self) -> None:
        """Until it is cancelled."""
        before = self._looks()
        while True:
            await asyncio.sleep(0)
            now = self._looks()
            self.most, before, self.turns = max(self.most, now - before), now, self.turns + 1


@asynccontextmanager
async def watched(service: JobService) -> AsyncIterator[LooksPerTurn]:
    looks = LooksPerTurn(service)
    task = asyncio.create_task(looks.watch())
    try:
        yield looks
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def test_a_pass_looks_at_the_vehicles_once_however_many_jobs_wait_for_one_that_is_not_ready() -> None:
    async with job_service(VEHICLES) as service:
        service.vehicles[1].put(landed=LandedState.IN_AIR)
        for _ in range(JOBS):
            await service.order(vehicle="v2")
        async with watched(service) as looks:
            await service.until(lambda: looks.turns > 0, "the watch must have begun")
            begun = service.vehicles[0].looks
            await service.until(
                lambda: service.vehicles[0].looks > begun + 20, "the scheduler must poll again and again"
            )
            turns = looks.turns
            await service.until(lambda: looks.turns > turns + 1, "the turn of that look must be counted")
        assert looks.most <= 2 * VEHICLES, "a look at every vehicle for every job stops the loop"


async def test_a_look_at_candidates_asks_few_vehicles_for_their_facts_in_one_turn() -> None:
    async with job_service(VEHICLES) as service:
        asked = most = before = 0
        read = service.fleet.facts

        async def counted(vehicle_id: str, *, fresh: bool = False) -> object:
            nonlocal asked
            asked += 1
            return await read(vehicle_id, fresh=fresh)

        service.fleet.facts = counted  # type: ignore[method-assign,assignment]

        async def watch() -> None:
            nonlocal most, before
            while True:
                await asyncio.sleep(0)
                most, before = max(most, asked - before), asked

        task = asyncio.create_task(watch())
        await service.order(vehicle="any", min_battery_percent=100)
        task.cancel()
        assert asked >= VEHICLES
        assert most <= VEHICLES // 2, "a hundred vehicles at once stop the loop"


async def test_the_queues_are_shown_with_what_each_vehicle_may_get_in_order() -> None:
    async with job_service(3) as service:
        for vehicle in service.vehicles:
            vehicle.put(landed=LandedState.IN_AIR)
        first = await service.order(vehicle="v2")
        second = await service.order(vehicle="any", priority=5)
        third = await service.order(vehicle="any", allowed_vehicles=["v1", "v2"])
        shown = await service.jobs.queues()
        assert [job.id for job in shown.waiting] == [second.id, first.id, third.id]
        assert [view.waiting for view in shown.vehicles] == [
            (second.id, third.id),
            (second.id, first.id, third.id),
            (second.id,),
        ]
