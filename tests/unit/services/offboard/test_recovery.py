"""After a kill the journal tells how offboard control has ended, once, and in the words of a normal end."""

from __future__ import annotations

import pytest

from app.domain.events import AnyPayload, Event, EventKind, NewEvent
from app.domain.events.vehicle import (
    GripperOutcome,
    OffboardChanged,
    OffboardLease,
    TaskChange,
    TasksChanged,
    TasksGripper,
)
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.offboard.tasks.forms import Circle, InsertMode, LocalPoint
from app.domain.reasons import Reason, ReasonCode
from app.services.clock import SystemClock
from app.services.journal import Journal
from app.services.offboard.offboard import endings, recover_interrupted
from tests.support.events import data_of
from tests.support.fakes import MemoryEventStore

LEASE, CHANGED, TASKS = EventKind.OFFBOARD_LEASE, EventKind.OFFBOARD_CHANGED, EventKind.TASK_CHANGED
RESTARTED = Reason.of(ReasonCode.OFFBOARD_SERVICE_RESTARTED)
CIRCLE = Circle(type="circle", center=LocalPoint(north_m=0.0, east_m=0.0), radius_m=20.0)


def told(payload: AnyPayload, vehicle_id: str = "v1") -> Event:
    new = NewEvent.of(payload, 1.0, vehicle_id=vehicle_id, run_id="r1")
    return new.numbered(1, "gw-1", "")


def lease(
    change: LeaseChange, holder: str = "ann", reason: Reason | None = None, other: str | None = None
) -> OffboardLease:
    return OffboardLease(change=change, holder=holder, other=other, reason=reason)


def queued(change: TaskChange, *task_list: int, mode: InsertMode | None = None) -> Event:
    return told(
        TasksChanged(change=change, task_id="t5", task=CIRCLE, holder="ann", insert_mode=mode, task_list=task_list)
    )


def test_what_was_open_ends_in_the_order_of_a_normal_end() -> None:
    last = [
        queued("inserted", 2, mode="append"),
        told(OffboardChanged(state=OffboardState.ACTIVE, holder="ann")),
        told(lease(LeaseChange.HANDED_OVER, other="bob")),
    ]
    ended = endings(last, 9.0)
    assert [(one.kind, one.time, one.vehicle_id, one.run_id) for one in ended] == [
        (kind, 9.0, "v1", "r1") for kind in (LEASE, CHANGED, TASKS)
    ]
    assert [one.data for one in ended] == [
        lease(LeaseChange.REVOKED, reason=RESTARTED),
        OffboardChanged(state=OffboardState.IDLE, holder=None, reason=RESTARTED),
        TasksChanged(change="dropped", task_id="t5", task=CIRCLE, holder=None, reason=RESTARTED, task_list=(0,)),
    ]


@pytest.mark.parametrize("change", [change for change in LeaseChange if change.ends])
def test_what_had_ended_is_not_ended_again(change: LeaseChange) -> None:
    last = [
        told(lease(change)),
        told(OffboardChanged(state=OffboardState.IDLE, holder=None)),
        queued("dropped", 0),
    ]
    assert endings(last, 9.0) == ()


def test_each_vehicle_is_told_of_by_itself() -> None:
    last = [
        told(lease(LeaseChange.ACQUIRED), "v2"),
        told(lease(LeaseChange.ACQUIRED, "bob"), "v1"),
        told(lease(LeaseChange.RELEASED, "eve"), "v3"),
    ]
    assert [(one.vehicle_id, data_of(one)["holder"]) for one in endings(last, 9.0)] == [("v1", "bob"), ("v2", "ann")]


@pytest.mark.parametrize(
    ("last", "task_id"),
    [
        (queued("inserted", 1, 2, mode="prepend"), "t5"),
        (queued("paused", 1, 2), "t5"),
        (queued("changed", 1), "t5"),
        (queued("inserted", 1, 2, mode="append"), None),  # behind the first one
        (queued("reached", 1), None),  # over
        (queued("removed", 1), None),
        (queued("moved", 1, 2), None),
    ],
)
def test_of_a_dropped_queue_only_its_first_task_is_named(last: Event, task_id: str | None) -> None:
    (ended,) = endings([last], 9.0)
    assert isinstance(ended.data, TasksChanged)
    assert (ended.data.task_id, ended.data.task) == (task_id, CIRCLE if task_id else None)


def gripper(outcome: GripperOutcome, reason: Reason | None = None, task_id: str = "t5") -> TasksGripper:
    return TasksGripper(task_id=task_id, action="release", outcome=outcome, reason=reason)


def test_a_gripper_command_without_an_outcome_is_unknown_and_names_the_task_that_was_flown() -> None:
    dropped, ended = endings([queued("inserted", 2, 2, mode="append"), told(gripper("sent"))], 9.0)
    assert ended.data == gripper("unknown", RESTARTED)
    assert isinstance(dropped.data, TasksChanged)
    assert (dropped.data.change, dropped.data.task_id, dropped.data.task) == ("dropped", "t5", CIRCLE)
    dropped, _ = endings([queued("inserted", 2, 2, mode="append"), told(gripper("sent", task_id="t4"))], 9.0)
    assert isinstance(dropped.data, TasksChanged)
    assert (dropped.data.task_id, dropped.data.task) == ("t4", None), "of the last event is another task"


@pytest.mark.parametrize("outcome", ["done", "failed", "unknown"])
def test_a_gripper_command_with_an_outcome_keeps_it(outcome: GripperOutcome) -> None:
    assert endings([told(gripper(outcome))], 9.0) == ()


async def test_a_kill_right_after_a_gripper_command_leaves_it_unknown_once() -> None:
    store, clock = MemoryEventStore(), SystemClock()
    sent = [lease(LeaseChange.ACQUIRED), gripper("done", task_id="t1"), gripper("sent")]
    await store.append([NewEvent.of(one, 1.0, vehicle_id="v1", run_id="r1") for one in sent])
    for _ in range(2):
        journal = Journal(store, clock)
        await journal.start()
        await recover_interrupted(journal, clock)
        await journal.close()
    told = [event.data for event in store.events if event.kind is EventKind.TASK_GRIPPER]
    assert told == [gripper("done", task_id="t1"), gripper("sent"), gripper("unknown", RESTARTED)]


async def test_a_restart_tells_the_ends_once() -> None:
    store, clock = MemoryEventStore(), SystemClock()
    await store.append([NewEvent.of(lease(LeaseChange.ACQUIRED), 1.0, vehicle_id="v1")])
    for _ in range(2):
        journal = Journal(store, clock)
        await journal.start()
        await recover_interrupted(journal, clock)
        await journal.close()
    assert [(event.kind, data_of(event)["change"]) for event in store.events] == [
        (LEASE, "acquired"),
        (LEASE, "revoked"),
    ]
