"""What is worked out of a plan or of a document: for a large one in the worker process, for others in a thread."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, Final, TypeVar

from app.domain.errors import PlanWorkTimeoutError
from app.domain.plan import Plan
from app.domain.ports.threads import InThread
from app.services.worker_process import WorkerLostError, WorkerProcess, WorkerTimeoutError

LARGE_ENTRIES: Final = 100
"""Items, vertices, and circles by their weight. A smaller plan is checked in about the time in which its way to the
worker and back is made.
"""
LARGE_DOCUMENT_BYTES: Final = 8 * 1024
"""A document of any content takes a thread ten milliseconds at most until it is so long."""
CIRCLE_WEIGHT: Final = 8
"""A circle is checked as a polygon of many corners, and a return flies around as many as this."""
MOST_FIELDS: Final = 30
"""No object of a plan has as many."""
ResultT = TypeVar("ResultT")


class PlanWork:
    """Runs pure functions of plans. Without a worker, or if that is lost, in a thread."""

    def __init__(self, worker: WorkerProcess | None = None, of_flights: InThread = asyncio.to_thread) -> None:
        """`of_flights` runs what a flight waits for: never in the worker, nor behind the work of others."""
        self.of_flights = of_flights
        self._worker = worker
        self._documents = asyncio.Lock()

    async def run(self, plan: Plan | object, work: Callable[..., ResultT], *given: Any) -> ResultT:
        """`work` of `given`. `plan`, parsed or as a JSON reader returned it, decides where.

        Raises PlanWorkTimeoutError.
        """
        run = self._in_worker if entries_of(plan) >= LARGE_ENTRIES else asyncio.to_thread
        return await run(work, *given)

    async def run_document(self, document: bytes, work: Callable[..., ResultT], *given: Any) -> ResultT:
        """`work` of a document that nobody has read yet, and of `given`. Its length decides where.

        Large ones are worked on one at a time, so that a plan waits for one of them at most.

        Raises PlanWorkTimeoutError.
        """
        if len(document) < LARGE_DOCUMENT_BYTES:
            return await asyncio.to_thread(work, document, *given)
        async with self._documents:
            return await self._in_worker(work, document, *given)

    async def _in_worker(self, work: Callable[..., ResultT], *given: Any) -> ResultT:
        if self._worker is not None:
            try:
                return await self._worker.call(work, *given)
            except WorkerLostError:  # logged
                pass
            except WorkerTimeoutError as error:
                raise PlanWorkTimeoutError(f"gave up: {error}") from error
        return await asyncio.to_thread(work, *given)


@asynccontextmanager
async def plan_work(of_flights: InThread = asyncio.to_thread) -> AsyncIterator[PlanWork]:
    """With a worker, which starts when it is needed first and ends with the block."""
    worker = WorkerProcess()
    try:
        yield PlanWork(worker, of_flights)
    finally:
        await worker.close()


def entries_of(plan: Plan | object) -> int:
    """How many items, vertices, or whatever a document has in their place. Nested deeper, nothing is counted."""
    if isinstance(plan, Plan):
        corners = sum(len(polygon.vertices) for polygon in plan.geofence.polygons)
        return len(plan.items) + corners + CIRCLE_WEIGHT * len(plan.geofence.circles)
    return _entries(plan, 4)


def _entries(value: object, depth: int) -> int:
    if not isinstance(value, Mapping | list):
        return 0
    own = len(value) if isinstance(value, list) else max(0, len(value) - MOST_FIELDS)
    if not depth or own >= LARGE_ENTRIES:
        return own
    if isinstance(value, list):
        return own + sum(_entries(part, depth - 1) for part in value)
    weights = {name: CIRCLE_WEIGHT if name == "circles" else 1 for name in value}
    return own + sum(weights[name] * _entries(part, depth - 1) for name, part in value.items())
