"""What a run records is stored once, whatever happens to the task that stores it."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import pytest

from app.domain.drop.record import DropOutcome, DropRecord
from app.domain.errors import StorageError
from app.domain.events import Event, EventKind
from app.domain.events.run import RunChanged, RunCommand, RunCommandName, RunDrop
from app.domain.plan import parse_plan
from app.domain.ports.stores import StoredAnswer, StoredPlan
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import VehicleType
from app.services.journal import Journal
from app.services.plan_checks import PlanCheck
from app.services.plans import NewPlan
from app.services.runs.recorder import MOST_WAITING, RunRecorder
from tests.support.events import item
from tests.support.fakes import ManualClock, MemoryEventStore
from tests.support.paths import PLANS
from tests.support.reasons import some

DROP = DropRecord(plan_item_id="drop", supervised=True)
PLAN = parse_plan((PLANS / "clinic-run.json").read_bytes())
RUN = Run(id="r", plan_id="p", plan_hash="h", vehicle_id="v1", drops=(DROP,), created_at=0.0, updated_at=0.0)


def changed(**fields: object) -> tuple[Run, list[RunChanged]]:
    run = RUN.model_copy(update=fields)
    return run, [RunChanged(run)]


def told(events: Sequence[Event]) -> Run | None:
    """The run as somebody has it who follows the events."""
    run: Run | None = None
    for event in events:
        match event.data:
            case RunChanged(root=changed):
                run = changed
            case RunDrop(root=drop) if run is not None:
                run = run.with_drop(drop, now=event.time)
            case _:
                pass
    return run


@pytest.mark.parametrize("meanwhile", [False, True])
async def test_after_a_full_disk_the_events_tell_the_run_as_it_is_stored(meanwhile: bool) -> None:
    events, clock = MemoryEventStore(), ManualClock()
    journal = Journal(events, clock)
    await journal.start()
    recorder = RunRecorder(RUN, journal, clock)
    recorder.update(*changed(reason=some("before")))
    for seq in range(MOST_WAITING + 5):
        recorder.record(item(seq))
    released = DROP.model_copy(update={"outcome": DropOutcome.RELEASED})
    dropped = RUN.with_drop(released, now=1.0)
    recorder.update(dropped, [RunDrop(released)])
    over = dropped.model_copy(update={"state": RunState.ABORTED})
    recorder.update(over, [RunChanged(over)])
    events.failures.append(StorageError("disk full"))
    with pytest.raises(StorageError):
        await recorder.flush()
    events.pause()
    storing = asyncio.create_task(recorder.flush())
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    if meanwhile:
        later = over.model_copy(update={"reason": some("later")})
        recorder.update(later, [RunChanged(later)])
    events.open.set()
    await storing
    stored = await recorder.flush()
    await journal.close()
    assert told(events.events) == stored == recorder.run == events.runs["r"]
    assert len(events.events) <= MOST_WAITING + 2


async def test_events_whose_storing_is_cancelled_are_stored_once() -> None:
    events, clock = MemoryEventStore(), ManualClock()
    journal = Journal(events, clock)
    await journal.start()
    recorder = RunRecorder(RUN, journal, clock)
    recorder.record(RunCommand(command=RunCommandName.ARM))
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


async def test_a_plan_that_is_taken_back_is_not_stored_later() -> None:
    events, clock = MemoryEventStore(), ManualClock()
    journal = Journal(events, clock)
    await journal.start()
    recorder = RunRecorder(RUN, journal, clock)
    for plan_id in ("p-2", "p-3"):
        stored = StoredPlan(plan_id, "h", "a plan", VehicleType.MULTICOPTER, 0.0, "ann", {})
        created = journal.new_event(item())
        recorder.attach_plan(NewPlan(stored, PLAN, created, PlanCheck(findings=(), timeline=None)))
    events.failures.append(StorageError("disk full"))
    with pytest.raises(StorageError):
        await recorder.flush()
    recorder.detach_plan("p-2")
    await recorder.flush()
    await journal.close()
    assert list(events.plans) == ["p-3"]


@pytest.mark.parametrize("is_full", [False, True])
async def test_whether_an_answer_is_stored_is_told_once_no_flush_is_under_way(is_full: bool) -> None:
    """The disk may have space again: a request that was refused meanwhile would be answered as accepted later."""
    events, clock = MemoryEventStore(), ManualClock()
    journal = Journal(events, clock)
    await journal.start()
    recorder = RunRecorder(RUN, journal, clock)
    answer = StoredAnswer("key", "hash", 202, {}, b"{}")
    recorder.update(*changed(reason=some("before")))
    recorder.attach_answer(answer)
    events.refuse = lambda _event: StorageError("disk full")
    with pytest.raises(StorageError):
        await recorder.flush()
    events.pause()
    others = asyncio.create_task(recorder.flush_or_wait())
    await asyncio.sleep(0)
    asked = asyncio.create_task(recorder.has_stored(answer))
    if not is_full:
        events.refuse = lambda _event: None
    events.open.set()
    assert await asked is not is_full
    assert (events.answers == [answer]) is not is_full
    await others
    await journal.close()
