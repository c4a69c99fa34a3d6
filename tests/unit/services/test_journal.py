"""An event is stored and numbered, then fanned out, then its recorder goes on."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from app.domain.errors import InvalidInputError, RecordRefusedError, StorageError
from app.domain.events import EventKind, NewEvent
from app.domain.run.run import Run
from app.services.journal import Journal, SubscriptionClosedError, SubscriptionOverflowError
from tests.support.events import data_of, item
from tests.support.fakes import ManualClock, MemoryEventStore

RUN = Run(id="run-1", plan_id="plan-1", plan_hash="0", vehicle_id="v1", created_at=0.0, updated_at=0.0)


def event(number: int = 0) -> NewEvent:
    return NewEvent.of(item(number), 0.0)


def full() -> StorageError:
    return StorageError("the disk is full")


@pytest.fixture
def store() -> MemoryEventStore:
    return MemoryEventStore()


@pytest.fixture
async def journal(store: MemoryEventStore) -> AsyncIterator[Journal]:
    journal = Journal(store, ManualClock(1234.5))
    await journal.start()
    yield journal
    store.open.set()
    await journal.close()


async def settle() -> None:
    """Let every task that can go on go on."""
    for _ in range(20):
        await asyncio.sleep(0)


async def test_record_returns_what_is_stored(journal: Journal, store: MemoryEventStore) -> None:
    assert list(await journal.record(event(1), event(2))) == store.events
    assert [stored.seq for stored in store.events] == [1, 2]


async def test_runs_are_stored_with_their_events(journal: Journal, store: MemoryEventStore) -> None:
    await journal.record(event(), runs=[RUN])
    assert store.runs == {"run-1": RUN}


async def test_a_new_event_has_the_time_of_now(journal: Journal) -> None:
    new = journal.new_event(item(3), vehicle_id="v1", run_id="run-1")
    assert (new.kind, new.version, new.time) == (EventKind.RUN_ITEM, 1, 1234.5)
    assert (new.vehicle_id, new.run_id, new.data) == ("v1", "run-1", item(3))


async def test_a_subscriber_has_the_event_before_its_recorder_goes_on(journal: Journal) -> None:
    subscription = journal.subscribe(10)
    (stored,) = await journal.record(event())
    assert subscription.get_nowait() == stored
    assert subscription.get_nowait() is None
    assert journal.last_seq == stored.seq


async def test_nothing_is_seen_before_it_is_stored(journal: Journal, store: MemoryEventStore) -> None:
    subscription = journal.subscribe(10)
    store.pause()
    recording = asyncio.create_task(journal.record(event()))
    await settle()
    assert not recording.done()
    assert subscription.get_nowait() is None
    assert journal.last_seq == 0
    store.open.set()
    await recording
    assert subscription.get_nowait() is not None


async def test_read_does_not_show_what_is_stored_but_not_fanned_out(store: MemoryEventStore) -> None:
    journal = Journal(store, ManualClock())
    await journal.start()
    await journal.record(event(1))
    await store.append([event(2)])  # as between the commit and the fan-out
    assert [stored.seq for stored in await journal.read(0, 10)] == [1]
    await journal.close()


async def test_calls_that_wait_for_the_disk_share_the_next_commit(journal: Journal, store: MemoryEventStore) -> None:
    store.pause()
    calls = [asyncio.create_task(journal.record(event(0), event(0)))]
    await settle()
    calls += [asyncio.create_task(journal.record(event(n), event(n))) for n in range(1, 10)]
    await settle()
    store.open.set()
    stored = await asyncio.gather(*calls)
    assert store.batches == [2, 18]
    assert [data_of(one)["seq"] for one in store.events] == [n for n in range(10) for _ in "ab"]
    assert [[one.seq for one in call] for call in stored] == [[2 * n + 1, 2 * n + 2] for n in range(10)]


async def test_a_commit_has_a_bounded_size(store: MemoryEventStore) -> None:
    journal = Journal(store, ManualClock(), batch_events=4)
    await journal.start()
    await asyncio.gather(*(journal.record(event(n)) for n in range(10)))
    assert max(store.batches) == 4
    await journal.close()


async def test_many_calls_that_wait_are_two_commits_so_that_one_is_answered_during_the_next(
    journal: Journal, store: MemoryEventStore
) -> None:
    store.pause()
    calls = [asyncio.create_task(journal.record(event(0)))]
    await settle()
    calls += [asyncio.create_task(journal.record(event(n))) for n in range(1, 401)]
    await settle()
    store.open.set()
    await asyncio.gather(*calls)
    assert store.batches == [1, 200, 128, 72]


async def test_a_slow_disk_holds_recorders_back_in_their_order(store: MemoryEventStore) -> None:
    journal = Journal(store, ManualClock(), queue_capacity=2, batch_events=1)
    await journal.start()
    store.pause()
    calls = [asyncio.create_task(journal.record(event(n))) for n in range(30)]
    await settle()
    late = asyncio.create_task(journal.record(event(30)))
    store.open.set()
    await asyncio.gather(*calls, late)
    assert [data_of(one)["seq"] for one in store.events] == list(range(31))
    await journal.close()


async def test_recording_nothing_waits_for_what_was_recorded_before(journal: Journal, store: MemoryEventStore) -> None:
    first = asyncio.create_task(journal.record(event()))
    await asyncio.sleep(0)
    assert list(await journal.record()) == []
    assert len(store.events) == 1
    await first


async def test_a_failure_reaches_every_recorder_and_nobody_else(journal: Journal, store: MemoryEventStore) -> None:
    subscription = journal.subscribe(10)
    store.pause()
    store.failures.append(full())  # of the commit of all four: none of them is tried again, to fail as late
    calls = [asyncio.create_task(journal.record(event(n))) for n in range(4)]
    await settle()
    store.open.set()
    answers = await asyncio.gather(*calls, return_exceptions=True)
    assert [type(answer) for answer in answers] == [StorageError] * 4
    assert subscription.get_nowait() is None
    assert not journal.healthy
    assert store.events == []


async def test_a_call_that_the_store_refuses_does_not_take_the_others_with_it(
    journal: Journal, store: MemoryEventStore
) -> None:
    store.refuse = lambda event: RecordRefusedError("a constraint") if data_of(event)["seq"] == 2 else None
    store.pause()
    calls = [asyncio.create_task(journal.record(event(n))) for n in range(4)]
    await settle()
    store.open.set()
    answers = await asyncio.gather(*calls, return_exceptions=True)
    assert isinstance(answers[2], RecordRefusedError)
    assert [data_of(one)["seq"] for one in store.events] == [0, 1, 3]


async def test_after_a_failure_the_journal_goes_on_without_a_gap(journal: Journal, store: MemoryEventStore) -> None:
    await journal.record(event(1))
    store.failures.append(full())
    with pytest.raises(StorageError):
        await journal.record(event(2))
    assert not journal.healthy
    (stored,) = await journal.record(event(3))
    assert stored.seq == 2
    assert journal.healthy


async def test_one_bad_call_does_not_take_the_others_with_it(journal: Journal, store: MemoryEventStore) -> None:
    store.refuse = lambda event: InvalidInputError("not JSON") if data_of(event)["seq"] == 2 else None
    store.pause()
    calls = [asyncio.create_task(journal.record(event(n))) for n in range(5)]
    await settle()
    store.open.set()
    answers = await asyncio.gather(*calls, return_exceptions=True)
    assert isinstance(answers[2], InvalidInputError)
    assert [data_of(one)["seq"] for one in store.events] == [0, 1, 3, 4]
    assert journal.healthy


async def test_a_recorder_that_is_cancelled_disturbs_nobody(journal: Journal, store: MemoryEventStore) -> None:
    store.pause()
    first, second = (asyncio.create_task(journal.record(event(n))) for n in range(2))
    await settle()
    first.cancel()
    store.open.set()
    await second
    assert [data_of(one)["seq"] for one in store.events] == [0, 1]
    await asyncio.gather(first, return_exceptions=True)


async def test_close_stores_what_was_recorded_before_and_refuses_what_comes_after(
    journal: Journal, store: MemoryEventStore
) -> None:
    subscription = journal.subscribe(100)
    store.pause()
    before = [asyncio.create_task(journal.record(event(n))) for n in range(5)]
    await settle()
    closing = asyncio.create_task(journal.close())
    await settle()
    with pytest.raises(StorageError, match="closed"):
        await journal.record(event(9))
    store.open.set()
    await closing
    assert len(await asyncio.gather(*before)) == len(store.events) == 5
    assert [(await subscription.get()).seq for _ in range(5)] == [1, 2, 3, 4, 5]
    with pytest.raises(SubscriptionClosedError):
        await subscription.get()


async def test_close_waits_for_recorders_that_wait_for_room(store: MemoryEventStore) -> None:
    journal = Journal(store, ManualClock(), queue_capacity=1, batch_events=1)
    await journal.start()
    store.pause()
    before = [asyncio.create_task(journal.record(event(n))) for n in range(6)]
    await settle()
    closing = asyncio.create_task(journal.close())
    await settle()
    store.open.set()
    await closing
    assert len(await asyncio.gather(*before)) == 6


async def test_closing_waits_for_no_second_failure(store: MemoryEventStore) -> None:
    journal = Journal(store, ManualClock(), batch_events=1)
    await journal.start()
    store.pause()
    before = [asyncio.create_task(journal.record(event(n))) for n in range(5)]
    await settle()
    closing = asyncio.create_task(journal.close())
    await settle()
    store.failures.append(full())
    store.open.set()
    await closing
    answers = await asyncio.gather(*before, return_exceptions=True)
    assert [type(answer) for answer in answers] == [StorageError] * 5


async def test_closing_stores_what_follows_a_call_that_the_store_refuses(store: MemoryEventStore) -> None:
    journal = Journal(store, ManualClock(), batch_events=2)
    await journal.start()
    store.refuse = lambda event: RecordRefusedError("a constraint") if data_of(event)["seq"] == 3 else None
    store.pause()
    before = [asyncio.create_task(journal.record(event(n))) for n in range(5)]  # commits of 0 and 1, 2 and 3, 4
    await settle()
    closing = asyncio.create_task(journal.close())
    await settle()
    store.open.set()
    await closing
    answers = await asyncio.gather(*before, return_exceptions=True)
    assert [isinstance(answer, RecordRefusedError) for answer in answers] == [False, False, False, True, False]
    assert [data_of(one)["seq"] for one in store.events] == [0, 1, 2, 4]


async def test_closing_twice_is_fine_and_a_closed_journal_is_not_healthy(journal: Journal) -> None:
    assert journal.healthy
    await journal.close()
    await journal.close()
    assert not journal.healthy


async def test_who_gives_up_closing_does_not_stop_the_commit(journal: Journal, store: MemoryEventStore) -> None:
    store.pause()
    recording = asyncio.create_task(journal.record(event()))
    await settle()
    closing = asyncio.create_task(journal.close())
    await settle()
    closing.cancel()
    await asyncio.gather(closing, return_exceptions=True)
    store.open.set()
    assert [stored.seq for stored in await recording] == [1]


async def test_before_its_start_a_journal_refuses(store: MemoryEventStore) -> None:
    journal = Journal(store, ManualClock())
    assert not journal.healthy
    with pytest.raises(StorageError, match="closed"):
        await journal.record(event())
    await journal.close()


async def test_a_journal_goes_on_after_the_newest_event_stored(store: MemoryEventStore) -> None:
    await store.append([event(1), event(2)])
    journal = Journal(store, ManualClock())
    await journal.start()
    assert journal.last_seq == 2
    assert [stored.seq for stored in await journal.record(event(3))] == [3]
    await journal.close()


async def test_a_defect_in_the_store_leaves_nobody_waiting(store: MemoryEventStore) -> None:
    def defect(event: NewEvent) -> None:
        raise ZeroDivisionError

    journal = Journal(store, ManualClock(), queue_capacity=1, batch_events=1)
    await journal.start()
    store.refuse = defect
    async with asyncio.timeout(20):
        answers = await asyncio.gather(*(journal.record(event(n)) for n in range(5)), return_exceptions=True)
    assert [type(answer) for answer in answers] == [StorageError] * 5
    assert not journal.healthy
    with pytest.raises(ZeroDivisionError):
        await journal.close()


async def test_a_slow_subscriber_is_cut_off_and_the_others_feel_nothing(journal: Journal) -> None:
    slow, quick = journal.subscribe(2), journal.subscribe(100)
    for number in range(5):
        await journal.record(event(number))
    assert slow.overflowed
    assert not quick.overflowed
    with pytest.raises(SubscriptionOverflowError):
        await slow.get()
    assert [(await quick.get()).seq for _ in range(5)] == [1, 2, 3, 4, 5]
