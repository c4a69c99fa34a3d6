"""The journal: an event is stored and numbered, then fanned out, then its recorder goes on."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Callable, Sequence
from dataclasses import dataclass
from typing import Final

from app.domain.errors import EventsPrunedError, InvalidInputError, RecordRefusedError, StorageError, WaydropError
from app.domain.events import AnyPayload, Event, NewEvent
from app.domain.events.service import JournalPruned
from app.domain.ports.journal import EventReader
from app.domain.ports.stores import EventStore, JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run
from app.services.clock import Clock


class SubscriptionClosedError(WaydropError, code="stream.closed"):
    """The subscription has ended and everything in it was taken."""


class SubscriptionOverflowError(SubscriptionClosedError, code="stream.overflow"):
    """The subscriber was too slow and was cut off: read the journal from the last event seen."""


class EventSubscription:
    """A bounded queue of events for one reader.

    `after` is the newest event that was sent to subscribers when it was created: its first event is `after + 1`. A
    reader with `capacity` unread events is disconnected when further ones arrive, and loses them all: it must never
    read an event after a gap. The events of one commit arrive together, so the queue holds at most `capacity` and one
    commit.
    """

    def __init__(self, capacity: int, after: int, forget: Callable[[EventSubscription], None]) -> None:
        if capacity < 1:
            raise ValueError("a subscription needs a capacity of at least one event")
        self.after = after
        self._capacity = capacity
        self._forget = forget
        self._events: deque[Event] = deque()
        self._changed = asyncio.Event()
        self._overflowed = False
        self._closed = False

    @property
    def overflowed(self) -> bool:
        """Whether the reader was cut off."""
        return self._overflowed

    async def get(self) -> Event:
        """Return the next event; wait for it.

        Raises:
            SubscriptionOverflowError: the reader was too slow; the events in the queue are dropped.
            SubscriptionClosedError: closed, and all events were read.
        """
        while (event := self.get_nowait()) is None:
            self._changed.clear()
            await self._changed.wait()
        return event

    def get_nowait(self) -> Event | None:
        """The next event if one is there, else None. Raises as `get` does."""
        if self._overflowed:
            raise SubscriptionOverflowError(
                f"the reader is more than {self._capacity} events behind",
                hint="reconnect with after= the last event received",
            )
        if self._events:
            return self._events.popleft()
        if self._closed:
            raise SubscriptionClosedError("the subscription is closed")
        return None

    def close(self) -> None:
        """End it: no further events are put in. Idempotent."""
        self._closed = True
        self._changed.set()
        self._forget(self)

    def enqueue(self, events: Sequence[Event]) -> None:
        """Put events in, or cut the reader off if it is full. For the fan-out alone."""
        if len(self._events) >= self._capacity:
            self._overflowed = True
            self._events.clear()
            self.close()
            return
        self._events.extend(events)
        self._changed.set()


class Fanout:
    """All subscriptions. Synchronous: a slow reader costs the others nothing."""

    def __init__(self) -> None:
        self._subscriptions: dict[int, EventSubscription] = {}
        self._closed = False

    def subscribe(self, capacity: int, after: int) -> EventSubscription:
        """A subscription to what is published from now on; a closed one if nothing will be."""
        subscription = EventSubscription(capacity, after, self._forget)
        self._subscriptions[id(subscription)] = subscription
        if self._closed:
            subscription.close()
        return subscription

    def publish(self, events: Sequence[Event]) -> None:
        """Send `events` to every subscriber."""
        for subscription in tuple(self._subscriptions.values()):
            subscription.enqueue(events)

    def close(self) -> None:
        """Close every subscription; readers still get what was published before."""
        self._closed = True
        for subscription in tuple(self._subscriptions.values()):
            subscription.close()

    def __len__(self) -> int:
        return len(self._subscriptions)

    def _forget(self, subscription: EventSubscription) -> None:
        self._subscriptions.pop(id(subscription), None)


QUEUE_CAPACITY: Final = 1024
"""Calls of record() that may wait; the next ones wait for room: a slow disk slows its writers, not the memory."""

BATCH_EVENTS: Final = 512
"""After this many events a commit accepts no further calls."""

UNDIVIDED_EVENTS: Final = 128
"""Events that are not worth a second commit. Of more, a commit takes half: while it goes to the disk, the event loop
answers the calls of the commit before, which record their next events."""

STORED_WITHIN_S: Final = 0.5
"""A person's command to a vehicle in flight waits this long for its record to be on disk, and is then sent all the
same."""


@dataclass(slots=True, eq=False)
class _Call:
    """A call of record() whose events are not stored yet."""

    events: Sequence[NewEvent]
    runs: Sequence[Run]
    plans: Sequence[StoredPlan]
    jobs: Sequence[JobRecord]
    answers: Sequence[StoredAnswer]
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
        self._waiting: deque[_Call] = deque()
        # Queue.put is not first come, first served when full; a Semaphore is
        self._slots = asyncio.Semaphore(queue_capacity)
        self._filled = asyncio.Event()
        self._fanout = Fanout()
        self._last_seq = 0
        self._pruned: JournalPruned | None = None
        self._healthy = False
        self._closed = True
        self._writer: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Continue after the newest stored event. Raises StorageError."""
        self._last_seq = await self._store.last_seq()
        self._pruned = await self._store.last_pruned()
        self._healthy = True
        self._closed = False
        self._writer = asyncio.create_task(self._write_all(), name="journal writer")

    async def close(self) -> None:
        """Store what was recorded before this call, until that fails, then close all subscriptions. Idempotent."""
        await self._slots.acquire()  # after all that record already
        self._closed = True
        self._filled.set()
        self._slots.release()
        try:
            if self._writer is not None:
                await asyncio.shield(self._writer)  # a caller that stops waiting must not stop the writer in a commit
        finally:
            self._fanout.close()

    @property
    def last_seq(self) -> int:
        """The newest event fanned out; 0 before the first."""
        return self._last_seq

    @property
    def pruned(self) -> JournalPruned | None:
        """See EventReader."""
        return self._pruned

    @property
    def healthy(self) -> bool:
        """Whether the last write succeeded: if not, nothing may be started that must be recorded."""
        return self._healthy

    async def has(self, position: int) -> bool:
        """See EventReader."""
        return position <= self._last_seq

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
        """Store events with the runs, plans and jobs that they concern, and the answers to the requests for them. Send
        the events to subscribers, and return them numbered.

        Events of one call have consecutive numbers and are stored together or not at all. If the caller is cancelled
        meanwhile, they may still be stored.

        Raises:
            StorageError: they are not stored, and were not sent to anybody.
            InvalidInputError: the data of an event is not JSON; they are not stored.
        """
        await self._slots.acquire()
        if self._closed:  # looked at only now: the writer may have died while the queue was full
            self._slots.release()
            raise StorageError("the journal is closed", hint="the service is starting or stopping")
        call = _Call(events, runs, plans, jobs, answers, asyncio.get_running_loop().create_future())
        self._waiting.append(call)
        self._filled.set()
        return await call.stored

    async def read(self, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """Fanned-out events with seq > after, in order, at most `limit`. Raises StorageError."""
        events = await self._store.read(after=after, limit=limit, run_id=run_id)
        # stored events that were not sent to subscribers yet would be repeated by a subscription made now
        return [event for event in events if event.seq <= self._last_seq]

    async def newest_accepted(self, before: int | None, limit: int) -> Sequence[Event]:
        """See EventStore. Raises StorageError."""
        return await self._store.newest_accepted(before=before, limit=limit)

    async def last_offboard(self) -> Sequence[Event]:
        """See EventStore. Raises StorageError."""
        return await self._store.last_offboard()

    def subscribe(self, capacity: int) -> EventSubscription:
        """All events after `last_seq`, as they come.

        Call it and read `last_seq` (or a snapshot built from events) with no await between: together they are
        every event once.
        """
        return self._fanout.subscribe(capacity, after=self._last_seq)

    async def _write_all(self) -> None:
        batch: list[_Call] = []
        try:
            while batch := await self._next_batch():
                goes_on = await self._store_batch(batch)
                if self._closed and not goes_on:
                    break  # the rest would keep a service that stops waiting
        finally:  # after close() nothing is left, unless the disk failed; after a defect nobody may wait for ever
            self._closed = True
            self._healthy = False
            batch += self._taken(len(self._waiting))
            _fail(batch, StorageError("the journal's writer has stopped"))

    async def _next_batch(self) -> list[_Call]:
        """The calls that wait, half of them if they are many; empty once closed. Waits for the first one only."""
        while not self._waiting and not self._closed:
            self._filled.clear()
            await self._filled.wait()
        most = min(self._batch_events, max(UNDIVIDED_EVENTS, len(self._waiting) // 2))
        calls = events = 0
        while calls < len(self._waiting) and events < most:
            events += len(self._waiting[calls].events)
            calls += 1
        return self._taken(calls)

    def _taken(self, calls: int) -> list[_Call]:
        for _ in range(calls):
            self._slots.release()
        return [self._waiting.popleft() for _ in range(calls)]

    async def _store_batch(self, batch: Sequence[_Call]) -> bool:
        """Whether the store takes calls, though it may have refused some of these."""
        events = [event for call in batch for event in call.events]
        runs = [run for call in batch for run in call.runs]
        plans = [plan for call in batch for plan in call.plans]
        jobs = [job for call in batch for job in call.jobs]
        answers = [answer for call in batch for answer in call.answers]
        try:
            stored = await self._store.append(events, runs, plans, jobs, answers)
        except WaydropError as error:
            self._healthy = not isinstance(error, StorageError)
            concerns_one = isinstance(error, InvalidInputError | RecordRefusedError)
            if concerns_one and len(batch) > 1:  # invalid data of one call must not affect the others
                return all([await self._store_batch((call,)) for call in batch])
            _fail(batch, error)  # a full disk or a lock concerns all: each alone would wait for it once more
            return concerns_one
        self._healthy = True
        self._publish(stored)
        _answer(batch, stored)
        return True

    def _publish(self, stored: Sequence[Event]) -> None:
        if stored:
            self._last_seq = stored[-1].seq
            for event in stored:
                if isinstance(event.data, JournalPruned):
                    self._pruned = event.data
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


PAGE_EVENTS: Final = 500


def first_seq(journal: EventReader) -> int:
    """The oldest event that is kept; 1 if all are, also before the first."""
    return 1 if journal.pruned is None else journal.pruned.up_to + 1


def of_another_journal(journal: EventReader, after: int) -> InvalidInputError:
    """The error for a position that the journal does not have."""
    return InvalidInputError(
        f"after={after}: the journal's newest event is {journal.last_seq}",
        hint="this is a different journal than before: start with after=0",
        last_seq=journal.last_seq,
    )


def kept_after(journal: EventReader, after: int) -> int:
    """Where to read on after `after`: 0 means from the oldest event that is kept.

    Raises EventsPrunedError: events after it were deleted.
    """
    first = first_seq(journal)
    if 0 < after < first - 1:
        raise _pruned(after, first)
    return max(after, first - 1)


async def kept_page(journal: EventReader, after: int, limit: int) -> Sequence[Event]:
    """Events after `after`, in order, at most `limit`.

    Raises EventsPrunedError: some of them were deleted, perhaps at this moment or by another node. StorageError.
    """
    page = await journal.read(after, limit)
    kept_after(journal, after)
    if after > 0 and page and page[0].position != after + 1:
        raise _pruned(after, page[0].position)
    return page


def _pruned(after: int, first: int) -> EventsPrunedError:
    return EventsPrunedError(
        f"after={after}: events up to {first - 1} were deleted by age",
        hint="read the current state, then continue with after=0, which begins at the oldest event that is kept",
        first_seq=first,
    )


async def follow(
    journal: EventReader, after: int, *, capacity: int, page_events: int = PAGE_EVENTS
) -> AsyncGenerator[Event, None]:
    """Every event with position > after, in order, without end. Close the generator (`aclosing`) to unsubscribe.

    `capacity` bounds how far the reader may fall behind the live events.

    Raises:
        InvalidInputError: `after` is not an event of this journal.
        EventsPrunedError: events after it were deleted by age.
        SubscriptionOverflowError: the reader was too slow; follow again after the last event seen.
        SubscriptionClosedError: the journal was closed.
        StorageError: the stored events cannot be read.
    """
    if not 0 <= after <= journal.last_seq:
        raise of_another_journal(journal, after)
    after = kept_after(journal, after)
    # most of a long backlog is read before subscribing, so that the live queue stays short
    while journal.last_seq - after > page_events:
        for event in await kept_page(journal, after, page_events):
            yield event
            after = event.position
    subscription = journal.subscribe(capacity)
    try:
        while after < subscription.after:
            for event in await kept_page(journal, after, min(page_events, subscription.after - after)):
                yield event
                after = event.position
        while True:
            yield await subscription.get()
    finally:
        subscription.close()
