"""A clock that is set and an event store in memory, both under the test's control."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

from app.domain.errors import WaydropError
from app.domain.events import Event, EventKind, NewEvent
from app.domain.events.service import JournalPruned
from app.domain.jobs.job import Job
from app.domain.jobs.queue import VehicleQueue
from app.domain.ports.stores import JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run


class ManualClock:
    """Stands still until a test moves it."""

    def __init__(self, now: float = 1_000_000.0) -> None:
        self.time_s = now

    def now(self) -> float:
        """See Clock."""
        return self.time_s

    def monotonic(self) -> float:
        """See Clock."""
        return self.time_s


OFFBOARD_KINDS = (EventKind.OFFBOARD_LEASE, EventKind.OFFBOARD_CHANGED, EventKind.TASK_CHANGED)


class MemoryEventStore:
    """EventStore in a list. `pause` holds appends back, `held` are those that wait; `turns` says how many turns of the
    loop each step takes.
    """

    def __init__(self, turns: Callable[[], int] = lambda: 0) -> None:
        self.events: list[Event] = []
        self.runs: dict[str, Run] = {}
        self.plans: dict[str, StoredPlan] = {}
        self.jobs: dict[str, Job] = {}
        self.queues: dict[str, VehicleQueue] = {}
        self.answers: list[StoredAnswer] = []
        self.batches: list[int] = []
        self.failures: list[WaydropError] = []
        self.refuse: Callable[[NewEvent], WaydropError | None] = lambda event: None
        self.open = asyncio.Event()
        self.open.set()
        self.held = 0
        self._turns = turns

    def pause(self) -> None:
        """Hold appends back until `open` is set."""
        self.open.clear()

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """See EventStore. Fails with the next of `failures`, or as `refuse` says of any event."""
        await self._pass_time()
        self.held += 1
        await self.open.wait()
        self.held -= 1
        if self.failures:
            raise self.failures.pop(0)
        for event in events:
            if error := self.refuse(event):
                raise error
        first = len(self.events) + 1
        stored = [event.numbered(seq, "gw-1", "") for seq, event in enumerate(events, first)]
        self.events += stored
        self.runs |= {run.id: run for run in runs}
        self.plans |= {plan.id: plan for plan in plans}
        self.jobs |= {job.id: job for job in jobs if isinstance(job, Job)}
        self.queues |= {queue.vehicle_id: queue for queue in jobs if isinstance(queue, VehicleQueue)}
        self.answers += answers
        self.batches.append(len(events))
        await self._pass_time()  # on disk, but the journal does not know yet
        return stored

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """See EventStore."""
        await self._pass_time()
        found = [event for event in self.events if event.seq > after and run_id in (None, event.run_id)][:limit]
        await self._pass_time()
        return found

    async def last_seq(self) -> int:
        """See EventStore."""
        return len(self.events)

    async def newest_accepted(self, *, before: int | None, limit: int) -> Sequence[Event]:
        """See EventStore."""
        found = [event for event in reversed(self.events) if event.kind is EventKind.REQUEST_ACCEPTED]
        return [event for event in found if before is None or event.seq < before][:limit]

    async def last_pruned(self) -> JournalPruned | None:
        """See EventStore."""
        return next((event.data for event in reversed(self.events) if isinstance(event.data, JournalPruned)), None)

    async def last_offboard(self) -> Sequence[Event]:
        """See EventStore."""
        newest = {(event.kind, event.vehicle_id): event for event in self.events if event.kind in OFFBOARD_KINDS}
        return sorted(newest.values(), key=lambda event: event.seq)

    async def _pass_time(self) -> None:
        for _ in range(self._turns()):
            await asyncio.sleep(0)


class MemoryFlightLog:
    """FlightLog in a dict."""

    def __init__(self) -> None:
        self.texts: dict[str, str] = {}

    async def append(self, run_id: str, text: str) -> None:
        self.texts[run_id] = self.texts.get(run_id, "") + text

    async def read(self, run_id: str) -> str:
        return self.texts.get(run_id, "")


class MemoryClaims:
    """ClaimStore in a set, shared by the nodes of a cluster. It also has what was ever claimed and released."""

    def __init__(self) -> None:
        self.keys: set[str] = set()
        self.claimed: list[str] = []
        self.released: list[str] = []

    async def claim(self, key: str) -> bool:
        is_new = key not in self.keys
        self.keys.add(key)
        if is_new:
            self.claimed.append(key)
        return is_new

    async def release(self, key: str) -> None:
        self.keys.discard(key)
        self.released.append(key)
