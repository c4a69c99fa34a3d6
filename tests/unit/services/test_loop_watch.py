"""A loop that turns late is measured always, and told with what held it up, once and not without end."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator

import pytest

from app.domain.errors import StorageError
from app.domain.events.service import LoopStalled
from app.services.journal import Journal
from app.services.loop_watch import BOUNDS_S, LoopDelays, LoopWatch, LoopWatchSettings
from tests.support.fakes import ManualClock, MemoryEventStore
from tests.support.service_in_process import until

SLOW = LoopWatchSettings(stall_s=0.4, record_every_s=0.0)
"""On a busy machine a loop may be late without any fault of ours."""


@pytest.fixture
def store() -> MemoryEventStore:
    return MemoryEventStore()


@pytest.fixture
async def journal(store: MemoryEventStore) -> AsyncIterator[Journal]:
    journal = Journal(store, ManualClock())
    await journal.start()
    yield journal
    await journal.close()


def told(store: MemoryEventStore) -> list[LoopStalled]:
    return [event.data for event in store.events if isinstance(event.data, LoopStalled)]


def holds_everybody_up(seconds: float) -> None:
    time.sleep(seconds)


def computes(seconds: float) -> None:
    end_s = time.thread_time() + seconds
    while time.thread_time() < end_s:
        pass


async def test_what_holds_the_loop_up_is_told_with_its_stack(journal: Journal, store: MemoryEventStore) -> None:
    watch = LoopWatch(journal, SLOW)
    async with watch.watching():
        await asyncio.sleep(0.05)
        holds_everybody_up(3.0)
        await until(lambda: any(one.delay_s > 2.8 for one in told(store)))
    stalled = max(told(store), key=lambda one: one.delay_s)
    assert stalled.cpu_s < 2.0, "it waited and did not compute"
    assert any(place.endswith("holds_everybody_up") for place in stalled.stack)
    assert not any("/" in place for place in stalled.stack), "no paths of this machine"
    assert watch.delays.worst_s == pytest.approx(stalled.delay_s, abs=0.001)


async def test_one_that_computes_says_so(journal: Journal, store: MemoryEventStore) -> None:
    async with LoopWatch(journal, SLOW).watching():
        await asyncio.sleep(0.05)
        computes(1.0)
        await until(lambda: any(one.delay_s > 0.8 for one in told(store)))
    assert max(one.cpu_s for one in told(store)) > 0.8


async def test_many_in_a_row_are_one_event_and_the_next_tells_the_worst(
    journal: Journal, store: MemoryEventStore
) -> None:
    watch = LoopWatch(journal, LoopWatchSettings(stall_s=0.2, record_every_s=10.0))
    async with watch.watching():
        await asyncio.sleep(0.05)
        for seconds in (0.4, 0.5, 0.9, 0.4):
            holds_everybody_up(seconds)
            await asyncio.sleep(0.1)
        assert len(told(store)) == 1
        await until(lambda: len(told(store)) == 2, timeout_s=60.0)
    first, second = told(store)
    assert first.others == 0
    assert (second.others >= 2, second.delay_s > 0.8) == (True, True)


async def test_a_loop_that_turns_is_measured_and_says_nothing(journal: Journal, store: MemoryEventStore) -> None:
    watch = LoopWatch(journal, LoopWatchSettings(stall_s=30.0))
    async with watch.watching():
        await until(lambda: sum(watch.delays.counts) >= 5)
    assert told(store) == []
    assert 0.0 <= watch.delays.sum_s <= watch.delays.worst_s * sum(watch.delays.counts)


async def test_a_full_disk_is_no_end_of_the_watch(journal: Journal, store: MemoryEventStore) -> None:
    store.failures = [StorageError("the disk is full")]
    async with LoopWatch(journal, SLOW).watching():
        await asyncio.sleep(0.05)
        holds_everybody_up(0.8)
        await until(lambda: not store.failures)
        holds_everybody_up(0.8)
        await until(lambda: bool(told(store)))


def test_delays_are_counted_by_their_bounds() -> None:
    delays = LoopDelays()
    for delay_s in (0.0, 0.001, 0.002, 0.3, 60.0):
        delays.add(delay_s)
    assert dict(zip((*BOUNDS_S, "more"), delays.counts, strict=True)) == {
        **dict.fromkeys(BOUNDS_S, 0),
        0.001: 2,
        0.0025: 1,
        0.5: 1,
        "more": 1,
    }
    assert delays.worst_s == 60.0
