"""The journal as an API node has it: all gateways' events by position, and the cluster's own."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from contextlib import aclosing
from typing import Final, Protocol

import structlog

from app.domain.cluster.ports import ClusterChanges
from app.domain.errors import StorageError
from app.domain.events import AnyPayload, Event, NewEvent
from app.domain.events.service import JournalPruned
from app.domain.ports.stores import EventStore, JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run
from app.services.background import begin_task, end_tasks
from app.services.clock import Clock
from app.services.journal import EventSubscription, Fanout

log = structlog.get_logger(__name__)

PAGE_EVENTS: Final = 500
RETRY_S: Final = 0.5
REACHED_TIMEOUT_S: Final = 5.0


class ClusterEvents(EventStore, ClusterChanges, Protocol):
    """The store of all events, which tells when there are new ones."""

    async def seqs(self) -> Mapping[str, int]:
        """The newest event of each gateway. Raises StorageError."""


class ClusterJournal:
    """EventJournal over the cluster's store. Events reach it through the store, also those recorded here."""

    def __init__(self, store: ClusterEvents, clock: Clock) -> None:
        self._store = store
        self._clock = clock
        self._fanout = Fanout()
        self.last_seq = 0
        self.pruned: JournalPruned | None = None
        self._seqs: dict[str, int] = {}
        self._moved = asyncio.Condition()
        self.healthy = False
        self._task: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Begin after the newest event. Raises StorageError."""
        self.last_seq = await self._store.last_seq()
        self._seqs = dict(await self._store.seqs())
        self.pruned = await self._store.last_pruned()
        self.healthy = True
        self._task = begin_task(self._run(), "cluster journal")

    async def close(self) -> None:
        """Stop, and close all subscriptions. Idempotent."""
        await end_tasks(self._task)
        self._fanout.close()

    def new_event(self, payload: AnyPayload, *, vehicle_id: str | None = None, run_id: str | None = None) -> NewEvent:
        return NewEvent.of(payload, self._clock.now(), vehicle_id=vehicle_id, run_id=run_id)

    async def record(
        self,
        *events: NewEvent,
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """See EventJournal. Returns after the events were fanned out here."""
        stored = await self._store.append(events, runs, plans, jobs, answers)
        if stored:
            await self.reached(stored[-1].gateway, stored[-1].seq)
        return stored

    async def read(self, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """See EventReader: fanned-out events."""
        events = await self._store.read(after=after, limit=limit, run_id=run_id)
        return [event for event in events if event.position <= self.last_seq]

    async def newest_accepted(self, before: int | None, limit: int) -> Sequence[Event]:
        """See EventStore. Raises StorageError."""
        return await self._store.newest_accepted(before=before, limit=limit)

    async def has(self, position: int) -> bool:
        """See EventReader. A client may have been told of a newer event by another node than this one has read."""
        if position > self.last_seq and position <= await self._store.last_seq():
            try:
                async with asyncio.timeout(REACHED_TIMEOUT_S), self._moved:
                    await self._moved.wait_for(lambda: self.last_seq >= position)
            except TimeoutError as error:
                raise StorageError(f"the event at {position} cannot be read yet") from error
        return position <= self.last_seq

    def subscribe(self, capacity: int) -> EventSubscription:
        return self._fanout.subscribe(capacity, after=self.last_seq)

    async def reached(self, gateway: str, seq: int) -> None:
        """Wait until an event of a gateway was fanned out here, but not for ever: the projection may be late."""

        def is_there() -> bool:
            return self._seqs.get(gateway, 0) >= seq

        try:
            async with asyncio.timeout(REACHED_TIMEOUT_S), self._moved:
                await self._moved.wait_for(is_there)
        except TimeoutError:
            log.warning("what a gateway has done cannot be read yet", gateway=gateway, seq=seq)

    async def _run(self) -> None:
        while True:
            try:
                async with aclosing(self._store.pages(self.last_seq, PAGE_EVENTS)) as pages:
                    async for events in pages:
                        self.healthy = True
                        await self._take(events)
            except StorageError as error:
                if self.healthy:
                    log.error("the cluster's store cannot be read", error=error.detail)
                self.healthy = False
            await asyncio.sleep(RETRY_S)

    async def _take(self, events: Sequence[Event]) -> None:
        if any(isinstance(event.data, JournalPruned) for event in events):  # of a gateway, or of the cluster itself
            self.pruned = await self._store.last_pruned()
        if events:
            self.last_seq = events[-1].position
            self._seqs |= {event.gateway: event.seq for event in events}
            self._fanout.publish(events)
            async with self._moved:
                self._moved.notify_all()
