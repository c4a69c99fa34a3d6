"""When the links prove that another gateway commands no vehicle any more, and how its runs are taken over."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager

from app.domain.cluster.lease import Leaseholder
from app.domain.cluster.ports import LEFT_RUNS, GatewaySite, LeftRun, LeftRunDocuments
from app.services.clock import SystemClock
from app.services.handover import HandoverQueue, SiteHandover
from app.services.remote.calls import Caller, CallServer
from tests.support.job_service import JobService, job_service
from tests.support.memory_cluster import MemoryBus, NoHandover

HOLDER = Leaseholder(gateway="gw-2", address="x", system_id=246, has_standby=True)
HELD_AGE_S = 10.0
SOON_S = 20.0
KEY = b"k" * 32


async def reached(gateway: str, seq: int) -> None:
    """Nothing is waited for."""


class Told:
    """What the cluster's store has of the service's runs: as the other gateway follows them, `number` times over."""

    def __init__(self, service: JobService) -> None:
        self._service = service

    async def left_runs(self, site: str, gateway: str, known: list[str]) -> list[LeftRun]:
        """See LeftRunCalls."""
        found = self._service.events.runs.values()
        return [LeftRun(run_id=run.id, vehicle_id=run.vehicle_id, gateway="gw-2", is_over=False) for run in found]

    async def left_run(self, run_id: str) -> LeftRunDocuments:
        """See LeftRunCalls."""
        run = self._service.events.runs[run_id].model_copy(update={"taken_over": None})
        return LeftRunDocuments(run=run, plans=())


@asynccontextmanager
async def handover_of(vehicles: int) -> AsyncIterator[tuple[JobService, SiteHandover]]:
    async with AsyncExitStack() as stack:
        one = await stack.enter_async_context(job_service(vehicles, site="north"))
        bus = MemoryBus()
        caller = Caller(bus, KEY, reached, SystemClock())
        part = GatewaySite(gateway="node", site=LEFT_RUNS)
        told = Told(one)
        functions = {"left_runs": told.left_runs, "left_run": told.left_run}
        server = CallServer(part, functions, KEY, lambda: 0, SystemClock())
        await stack.enter_async_context(bus.answering(LEFT_RUNS, server.answer))
        yield one, SiteHandover(GatewaySite(gateway="gw-1", site="north"), 245, one.fleet, one.runs, one.plans, caller)


def left(vehicle_id: str) -> LeftRun:
    return LeftRun(run_id="run-1", vehicle_id=vehicle_id, gateway="gw-2", is_over=False)


async def test_it_was_heard_until_it_lost_its_lease_and_is_not_any_more() -> None:
    async with handover_of(1) as (here, handover):
        (vehicle,) = here.vehicles
        for age_s, proves in ((None, False), (5.9, False), (6.0, True), (15.0, True), (19.0, False), (3600.0, False)):
            vehicle.station_age_s = age_s
            assert handover.is_silent(HOLDER, (), HELD_AGE_S) is proves, f"last heard {age_s} s ago"


async def test_a_gateway_whose_system_id_is_not_known_or_is_ours_is_never_silent() -> None:
    async with handover_of(1) as (here, handover):
        here.vehicles[0].station_age_s = 6.0
        for system_id in (0, 245):
            assert not handover.is_silent(HOLDER.model_copy(update={"system_id": system_id}), (), HELD_AGE_S)


async def test_each_vehicle_that_it_flies_must_be_heard_and_a_parked_one_need_not() -> None:
    async with handover_of(2) as (here, handover):
        first, second = here.vehicles
        first.station_age_s = second.station_age_s = 6.0
        assert not handover.has_lost_a_vehicle()
        assert not handover.is_silent(HOLDER, (left("north-v9"),), HELD_AGE_S), "it was never seen here"
        second.put(connected=False)
        assert handover.has_lost_a_vehicle()
        assert handover.is_silent(HOLDER, (left("north-v1"),), HELD_AGE_S)
        assert not handover.is_silent(HOLDER, (left("north-v2"),), HELD_AGE_S), "what happens there is not known"
        first.station_age_s = 1.0
        assert not handover.is_silent(HOLDER, (), HELD_AGE_S)


async def test_a_run_that_was_taken_over_is_not_taken_over_again_from_an_older_document() -> None:
    async with handover_of(1) as (here, handover):
        run = await here.runs.create("plan-1", "north-v1", start=False, actor="test")
        (left_one,) = await handover.runs_left()
        await handover.take_over(left_one)
        taken = await here.runs.get(run.id)
        assert taken.handovers == 1
        assert await handover.runs_left() == [], "the store has not learnt yet that it is this gateway's now"
        await handover.take_over(left_one)
        assert (await here.runs.get(run.id)).handovers == 1


async def test_an_own_run_is_reclaimed_with_a_number_that_the_other_gateway_did_not_give() -> None:
    async with handover_of(2) as (here, handover):
        mine = await here.runs.create("plan-1", "north-v1", start=False, actor="test")
        other = await here.runs.create("plan-1", "north-v2", start=False, actor="test")
        await handover.reclaim(
            "gw-2", (LeftRun(run_id=other.id, vehicle_id="north-v2", gateway="gw-2", is_over=False),)
        )
        assert (await here.runs.get(mine.id)).handovers == 2
        assert (await here.runs.get(other.id)).handovers == 0, "it is taken over as the other one left it"
        await here.until(lambda: here.events.runs[mine.id].is_over, "what was not started is given up")


async def test_runs_that_are_found_meanwhile_are_taken_over_too_and_one_that_is_gone_is_let_go() -> None:
    scripted = NoHandover()
    queue = HandoverQueue(scripted)
    first, second = (left("v1").model_copy(update={"run_id": run_id}) for run_id in ("run-1", "run-2"))
    queue.expect((left("v1").model_copy(update={"run_id": "run-0"}), first))
    scripted.gone = {"run-0"}
    scripted.meanwhile = lambda: queue.expect((second,))
    work = asyncio.create_task(queue.work(lambda: True))
    try:
        async with asyncio.timeout(SOON_S):
            while queue.run_ids or queue.is_untried:
                await asyncio.sleep(0.005)
        assert scripted.taken == ["run-1", "run-2"]
    finally:
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)
