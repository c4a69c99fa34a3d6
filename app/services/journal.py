"""The journal: an event is stored and numbered, then fanned out, then its recorder goes on."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from app.domain.errors import StorageError, WaydropError
from app.domain.events import AnyPayload, Event, NewEvent
from app.domain.jobs.port import JobRecord
from app.domain.ports import EventStore, StoredPlan
from app.domain.run import Run
from app.services.clock import Clock
from app.services.fanout import EventSubscription, Fanout

QUEUE_CAPACITY: Final = 1024
"""Calls of record() that may wait; the next ones wait for room: a slow disk slows its writers, not the memory."""

BATCH_EVENTS: Final = 512
"""Events after which a commit takes no further calls in."""


@dataclass(frozen=True, slots=True, eq=False)
class _Call:
    """One call of record() on its way to the disk."""

    events: Sequence[NewEvent]
    runs: Sequence[Run]
    plans: Sequence[StoredPlan]
    jobs: Sequence[JobRecord]
    stored: asyncio.Future[Sequence[Event]]


class Journal:
    """One writer task stores what any number of tasks record, many calls in one commit (group commit).

    The order of events is the order in which record() was called. Nothing is fanned out, or visible through
    `read`, before it is on disk.
    """

    def __init__(
        self, store: EventStore, clock: Clock, *, queue_capacity: int = QUEUE_CAPACITY, batch_events: int = BATCH_EVENTS
    ) -> None:
        self._store = store
        self._clock = clock
        self._batch_events = batch_events
        self._queue: asyncio.Queue[_Call | None] = asyncio.Queue(queue_capacity)
        # Queue.put is not first come, first served when full; a Lock is
        self._entry = asyncio.Lock()
        self._fanout = Fanout()
        self._last_seq = 0
        self._healthy = False
        self._closed = True
        self._writer: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Go on after the newest event stored. Raises StorageError."""
        self._last_seq = await self._store.last_seq()
        self._healthy = True
        self._closed = False
        self._writer = asyncio.create_task(self._write_all(), name="journal writer")

    async def close(self) -> None:
        """Store what was recorded before this call, then close all subscriptions. Idempotent."""
        async with self._entry:
            if not self._closed:
                self._closed = True
                await self._queue.put(None)
        try:
            if self._writer is not None:
                await asyncio.shield(self._writer)  # who gives up waiting must not stop the writer in a commit
        finally:
            self._fanout.close()

    @property
    def last_seq(self) -> int:
        """The newest event fanned out; 0 before the first."""
        return self._last_seq

    @property
    def healthy(self) -> bool:
        """Whether the last write succeeded: if not, nothing may be started that must be recorded."""
        return self._healthy

    def new_event(self, payload: AnyPayload, *, vehicle_id: str | None = None, run_id: str | None = None) -> NewEvent:
        """An event that happens now."""
        return NewEvent.of(payload, self._clock.now(), vehicle_id=vehicle_id, run_id=run_id)

    async def record(
        self,
        *events: NewEvent,
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
    ) -> Sequence[Event]:
        """Store events with the runs, plans and jobs that they tell of, fan them out, and return them numbered.

        One call's events have consecutive numbers and are stored together or not at all. If the caller is cancelled
        meanwhile, they may still be stored.

        Raises:
            StorageError: they are not stored, and nobody was told of them.
            InvalidInputError: an event's data is not JSON; they are not stored.
        """
        call = _Call(events, runs, plans, jobs, asyncio.get_running_loop().create_future())
        async with self._entry:
            self._refuse_if_closed()
            await self._queue.put(call)
            self._refuse_if_closed()  # the writer may have died while the queue was full
        return await call.stored

    async def read(self, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """Fanned-out events with seq > after, in order, at most `limit`. Raises StorageError."""
        events = await self._store.read(after=after, limit=limit, run_id=run_id)
        # what is on disk but not fanned out yet would come a second time through a subscription made now
        return [event for event in events if event.seq <= self._last_seq]

    async def last_by_hand(self) -> Sequence[Event]:
        """See EventStore. Raises StorageError."""
        return await self._store.last_by_hand()

    def subscribe(self, capacity: int) -> EventSubscription:
        """All events after `last_seq`, as they come.

        Call it and read `last_seq` (or a snapshot built from events) with no await between: together they are
        every event once.
        """
        return self._fanout.subscribe(capacity, after=self._last_seq)

    def _refuse_if_closed(self) -> None:
        if self._closed:
            raise StorageError("the journal is closed", hint="the service is starting or stopping")

    async def _write_all(self) -> None:
        batch: list[_Call] = []
        try:
            while batch := await self._next_batch():
                await self._store_batch(batch)
        finally:  # after close() nothing is left; after a defect nobody may wait for ever
            self._closed = True
            self._healthy = False
            while not self._queue.empty():
                batch += [call] if (call := self._queue.get_nowait()) else []
            _fail(batch, StorageError("the journal's writer has stopped"))

    async def _next_batch(self) -> list[_Call]:
        """All calls that wait, up to the size of a batch; empty once closed. Waits for the first one only."""
        first = await self._queue.get()
        batch = [first] if first else []
        events = len(first.events) if first else 0
        while batch and events < self._batch_events and not self._queue.empty():
            call = self._queue.get_nowait()
            if call is None:
                self._queue.put_nowait(None)  # the end comes after this batch
                break
            batch.append(call)
            events += len(call.events)
        return batch

    async def _store_batch(self, batch: Sequence[_Call]) -> None:
        events = [event for call in batch for event in call.events]
        runs = [run for call in batch for run in call.runs]
        plans = [plan for call in batch for plan in call.plans]
        jobs = [job for call in batch for job in call.jobs]
        try:
            stored = await self._store.append(events, runs, plans, jobs)
        except WaydropError as error:
            self._healthy = not isinstance(error, StorageError)
            if len(batch) == 1:
                _fail(batch, error)
                return
            for call in batch:  # one call's bad data must not take the others with it
                await self._store_batch((call,))
            return
        self._healthy = True
        self._publish(stored)
        _answer(batch, stored)

    def _publish(self, stored: Sequence[Event]) -> None:
        if stored:
            self._last_seq = stored[-1].seq
            self._fanout.publish(stored)


def _answer(batch: Sequence[_Call], stored: Sequence[Event]) -> None:
    start = 0
    for call in batch:
        end = start + len(call.events)
        if not call.stored.done():  # done: its caller was cancelled
            call.stored.set_result(stored[start:end])
        start = end


def _fail(batch: Sequence[_Call], error: WaydropError) -> None:
    for call in batch:
        if not call.stored.done():
            call.stored.set_exception(error)
