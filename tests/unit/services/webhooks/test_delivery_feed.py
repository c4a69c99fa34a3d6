"""What is news survives errors of the disk and the cache's bound."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from app.domain.errors import StorageError
from app.domain.events import Event
from app.domain.events.run import RunChanged, RunCreated
from app.domain.run.run import RunState
from app.services.journal import Journal
from app.services.webhooks.delivery import KEPT, DeliveryFeed
from tests.support.delivery_feed import Plans
from tests.support.fakes import ManualClock, MemoryEventStore
from tests.support.run_events import RunEvents, new_run


async def journal_of(events: Sequence[Event]) -> Journal:
    store = MemoryEventStore()
    store.events += events
    journal = Journal(store, ManualClock())
    await journal.start()
    return journal


async def test_an_event_that_could_not_be_told_for_the_disk_is_told_at_the_next_try() -> None:
    run_events = RunEvents(new_run())
    events = [
        run_events.created(),
        run_events.changed(state=RunState.UPLOADED),
        run_events.changed(state=RunState.ABORTED),
    ]
    journal = await journal_of(events)
    feed = DeliveryFeed(journal, Plans(failures=2))
    with pytest.raises(StorageError):
        await feed.messages(events[0])
    with pytest.raises(StorageError):
        await feed.messages(events[0])
    told = [message for event in events for message in await feed.messages(event)]
    assert [one.type.value for one in told] == ["delivery.created", "delivery.ready", "delivery.aborted"]
    assert {one.run.order_id for one in told if one.run} == {"RX-1"}
    await journal.close()


async def test_runs_beyond_the_cache_are_read_anew_and_told_as_if_they_had_stayed() -> None:
    run_events = RunEvents(new_run())
    runs = [f"r{number}" for number in range(KEPT + 5)]
    events: list[Event] = []
    for state in (RunState.CREATED, RunState.UPLOADED, RunState.FAILED):
        for run_id in runs:
            run_events.run = new_run(state=state).model_copy(update={"id": run_id})
            told_as = RunCreated if state is RunState.CREATED else RunChanged
            events.append(run_events.event(told_as(run_events.run)))
    journal = await journal_of(events)
    feed = DeliveryFeed(journal, Plans())
    told = [message.type.value for event in events for message in await feed.messages(event)]
    expected = ["delivery.created", "delivery.ready", "delivery.failed"]
    assert told == [name for name in expected for _ in runs]
    await journal.close()
