"""Runs at an API node, as the sockets are shown them."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Mapping, Sequence

from app.domain.ports.stores import ALL_RUNS, RunFilter, StoredPlan
from app.domain.run.run import Run, RunState
from app.services.clock import SystemClock
from app.services.plans import KnownPlans
from app.services.remote.calls import Caller
from app.services.remote.fleet import Gateways, RemoteFleet
from app.services.remote.journal import ClusterJournal
from app.services.remote.runs import RemoteRuns
from tests.support.memory_cluster import MemoryBus, MemoryClusterEvents
from tests.support.stored_samples import run


class SlowRuns:
    """A RunStore that returns what it had when it was asked."""

    def __init__(self) -> None:
        self.runs: list[Run] = []
        self.reads = 0

    async def get(self, run_id: str) -> Run | None:
        """See RunStore."""
        return next((one for one in self.runs if one.id == run_id), None)

    async def list_runs(self, wanted: RunFilter = ALL_RUNS, *, limit: int) -> Sequence[Run]:
        """See RunStore."""
        self.reads += 1
        found = tuple(self.runs[:limit])
        await asyncio.sleep(0)
        return found

    async def open_states(self) -> Mapping[RunState, int]:
        """See RunStore."""
        return Counter(run.state for run in self.runs)


class NoPlans:
    """A PlanStore without any."""

    async def get(self, plan_id: str) -> StoredPlan | None:
        """See PlanStore."""
        return None

    async def list_plans(self, *, limit: int, older_than: str | None = None) -> Sequence[StoredPlan]:
        """See PlanStore."""
        return ()


async def test_sockets_that_open_at_once_share_a_read_that_began_after_they_asked() -> None:
    clock, store, bus = SystemClock(), SlowRuns(), MemoryBus()
    gateways = Gateways(Caller(bus, b"key", ClusterJournal(MemoryClusterEvents(), clock), clock))
    runs = RemoteRuns(store, KnownPlans(NoPlans()), RemoteFleet(clock), gateways)
    first = asyncio.create_task(runs.open_and_recent(20))
    while not store.reads:
        await asyncio.sleep(0)
    store.runs.append(run(1))
    late = [asyncio.create_task(runs.open_and_recent(20)) for _ in range(500)]
    await first
    shown = await asyncio.gather(*late)
    assert [[one.id for one in each] for each in shown] == [["run-1"]] * 500, "nobody is shown what was before"
    assert store.reads <= 4, "and few reads are enough for many"
