"""What a run records is stored once, whatever happens to the task that stores it."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.events import EventKind
from app.domain.run import Run
from app.services.journal import Journal
from app.services.runs.recorder import RunRecorder
from tests.unit.services.fakes import ManualClock, MemoryEventStore


async def test_events_whose_storing_is_cancelled_are_stored_once() -> None:
    events, clock = MemoryEventStore(), ManualClock()
    journal = Journal(events, clock)
    await journal.start()
    recorder = RunRecorder(
        Run(id="r", plan_id="p", plan_hash="h", vehicle_id="v1", created_at=0.0, updated_at=0.0), journal, clock
    )
    recorder.note(EventKind.RUN_COMMAND, command="arm")
    events.pause()
    storing = asyncio.create_task(recorder.flush())
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    storing.cancel()
    await asyncio.sleep(0)
    events.open.set()
    with pytest.raises(asyncio.CancelledError):
        await storing
    await recorder.flush()
    await journal.close()
    assert [event.kind for event in events.events] == [EventKind.RUN_COMMAND]
