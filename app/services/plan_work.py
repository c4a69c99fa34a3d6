"""What is worked out of a plan: for a large one in the worker process, for others in a thread."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, Final, TypeVar

from app.domain.plan import Plan
from app.services.worker_process import WorkerLostError, WorkerProcess

LARGE_ENTRIES: Final = 100
"""Items and vertices. A smaller plan is checked in about the time in which its way to the worker and back is made."""
MOST_FIELDS: Final = 30
"""No object of a plan has as many."""
ResultT = TypeVar("ResultT")


class PlanWork:
    """Runs pure functions of plans. Without a worker, or if that is lost, in a thread."""

    def __init__(self, worker: WorkerProcess | None = None) -> None:
        self._worker = worker

    async def run(self, plan: Plan | object, work: Callable[..., ResultT], *given: Any) -> ResultT:
        """`work` of `given`. `plan`, parsed or as a JSON reader returned it, decides where."""
        if self._worker is not None and entries_of(plan) >= LARGE_ENTRIES:
            try:
                return await self._worker.call(work, *given)
            except WorkerLostError:  # logged
                pass
        return await asyncio.to_thread(work, *given)


@asynccontextmanager
async def plan_work() -> AsyncIterator[PlanWork]:
    """With a worker, which starts when it is needed first and ends with the block."""
    worker = WorkerProcess()
    try:
        yield PlanWork(worker)
    finally:
        await worker.close()


def entries_of(plan: Plan | object) -> int:
    """How many items, vertices, or whatever a document has in their place. Nested deeper, nothing is counted."""
    if isinstance(plan, Plan):
        return len(plan.items) + sum(len(polygon.vertices) for polygon in plan.geofence.polygons)
    return _entries(plan, 4)


def _entries(value: object, depth: int) -> int:
    if not isinstance(value, Mapping | list):
        return 0
    own = len(value) if isinstance(value, list) else max(0, len(value) - MOST_FIELDS)
    if not depth or own >= LARGE_ENTRIES:
        return own
    return own + sum(_entries(part, depth - 1) for part in (value.values() if isinstance(value, Mapping) else value))
