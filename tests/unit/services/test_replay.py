"""A client that says `after=` sees every event once, in order, whatever happens at the same time."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import aclosing
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.errors import InvalidInputError
from app.domain.events import Event, NewEvent
from app.services.journal import Journal, SubscriptionClosedError, SubscriptionOverflowError, follow
from tests.support.events import item
from tests.support.fakes import ManualClock, MemoryEventStore


def event(number: int = 0) -> NewEvent:
    return NewEvent.of(item(number), 0.0)


@pytest.mark.parametrize("after", [-1, 3])
async def test_a_number_that_is_not_of_this_journal_is_refused(after: int) -> None:
    store = MemoryEventStore()
    await store.append([event(1), event(2)])
    journal = Journal(store, ManualClock())
    await journal.start()
    with pytest.raises(InvalidInputError, match=r"newest event is 2"):
        await anext(follow(journal, after, capacity=10))
    await journal.close()


async def test_following_ends_its_subscription_when_it_is_closed() -> None:
    journal = Journal(MemoryEventStore(), ManualClock())
    await journal.start()
    async with aclosing(follow(journal, 0, capacity=1)) as following:
        await journal.record(event())
        assert (await anext(following)).seq == 1
    for number in range(3):
        await journal.record(event(number))  # nobody is there to be cut off
    await journal.close()


async def test_a_long_backlog_does_not_overflow_the_live_queue() -> None:
    store = MemoryEventStore()
    await store.append([event(number) for number in range(100)])
    journal = Journal(store, ManualClock())
    await journal.start()
    seqs = []
    async with aclosing(follow(journal, 0, capacity=3, page_events=10)) as following:
        async for seen in following:
            seqs.append(seen.seq)
            if seen.seq <= 50:
                await journal.record(event())  # the journal grows while the backlog is read
            if seen.seq == 150:
                break
    assert seqs == list(range(1, 151))
    await journal.close()


async def test_what_is_recorded_while_the_backlog_is_read_comes_once() -> None:
    store = MemoryEventStore()
    await store.append([event(1), event(2)])
    journal = Journal(store, ManualClock())
    await journal.start()
    read = journal.read

    async def slow_read(after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        await journal.record(event())  # one more event after each decision to read
        return await read(after, limit, run_id)

    journal.read = slow_read  # type: ignore[method-assign]
    async with aclosing(follow(journal, 0, capacity=10, page_events=10)) as following:
        assert [(await anext(following)).seq for _ in range(3)] == [1, 2, 3]
    await journal.close()


@dataclass
class Reader:
    """A client that reads slowly, and connects again after the last event seen when it is cut off."""

    after: int
    capacity: int
    page_events: int
    pace: int
    seen: list[int]

    async def read(self, journal: Journal) -> None:
        last = self.after
        while True:
            try:
                async with aclosing(
                    follow(journal, last, capacity=self.capacity, page_events=self.page_events)
                ) as following:
                    async for event in following:
                        self.seen.append(event.seq)
                        last = event.seq
                        for _ in range(self.pace):
                            await asyncio.sleep(0)
            except SubscriptionOverflowError:
                continue
            except SubscriptionClosedError:
                return


@dataclass(frozen=True)
class Program:
    """What happens, in order: a record of n events, a reader that comes, or time that passes."""

    stored_before: int
    steps: list[tuple[str, int, int, int, int]]
    store_turns: list[int]


programs = st.builds(
    Program,
    stored_before=st.integers(0, 30),
    steps=st.lists(
        st.tuples(
            st.sampled_from(["record", "record", "subscribe", "wait"]),
            st.integers(1, 6),
            st.integers(1, 8),
            st.integers(1, 12),
            st.integers(0, 4),
        ),
        max_size=40,
    ),
    store_turns=st.lists(st.integers(0, 5), min_size=1, max_size=10),
)


async def run(program: Program) -> tuple[MemoryEventStore, list[Reader]]:
    turns = iter(program.store_turns * 10_000)
    store = MemoryEventStore(lambda: next(turns, 0))
    await store.append([event() for _ in range(program.stored_before)])
    journal = Journal(store, ManualClock(), queue_capacity=3, batch_events=8)
    await journal.start()
    readers: list[Reader] = []
    tasks: list[asyncio.Task[object]] = []
    for what, first, second, third, fourth in program.steps:
        if what == "record":
            tasks.append(asyncio.create_task(journal.record(*(event() for _ in range(first)))))
        elif what == "subscribe":
            after = journal.last_seq * (first - 1) // 5
            readers.append(Reader(after, capacity=second, page_events=third, pace=fourth, seen=[]))
            tasks.append(asyncio.create_task(readers[-1].read(journal)))
        else:
            for _ in range(first * 3):
                await asyncio.sleep(0)
    await asyncio.sleep(0)  # every task above has begun
    await journal.close()
    await asyncio.gather(*tasks)
    return store, readers


@settings(max_examples=300, deadline=None)
@given(programs)
def test_every_reader_sees_every_event_once_in_order(program: Program) -> None:
    store, readers = asyncio.run(run(program))
    recorded = sum(step[1] for step in program.steps if step[0] == "record")
    assert len(store.events) == program.stored_before + recorded
    for reader in readers:
        assert reader.seen == list(range(reader.after + 1, len(store.events) + 1))
