"""After a kill the journal tells how flying by hand has ended, once, and in the words of a normal end."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.events import Event, EventKind, NewEvent
from app.services.clock import SystemClock
from app.services.journal import Journal
from app.services.offboard.left_open import endings, tell_left_open
from tests.unit.services.fakes import MemoryEventStore

LEASE, CHANGED, TASKS = EventKind.OFFBOARD_LEASE, EventKind.OFFBOARD_CHANGED, EventKind.TASKS_CHANGED
RESTARTED = "the service was restarted"
CIRCLE = {"type": "circle"}


def told(kind: EventKind, vehicle_id: str = "v1", **data: Any) -> Event:
    return Event(kind=kind, time=1.0, vehicle_id=vehicle_id, run_id="r1", data=data, seq=1, gateway="gw-1", hash="")


def queued(change: str, *task_list: int, reason: str = "") -> Event:
    task = {"task_id": "t5", "task": CIRCLE, "holder": "ann", "reason": reason, "task_list": list(task_list)}
    return told(TASKS, change=change, **task)


def test_what_was_open_ends_in_the_order_of_a_normal_end() -> None:
    last = [
        queued("inserted", 2, reason="append"),
        told(CHANGED, state="active", holder="ann", reason=""),
        told(LEASE, change="handed_over", holder="ann", reason="bob"),
    ]
    ended = endings(last, 9.0)
    assert [(one.kind, one.time, one.vehicle_id, one.run_id) for one in ended] == [
        (kind, 9.0, "v1", "r1") for kind in (LEASE, CHANGED, TASKS)
    ]
    assert [one.data for one in ended] == [
        {"change": "revoked", "holder": "ann", "reason": RESTARTED},
        {"state": "idle", "holder": None, "reason": RESTARTED},
        {
            "change": "dropped",
            "task_id": "t5",
            "task": CIRCLE,
            "holder": None,
            "reason": RESTARTED,
            "task_list": [0],
        },
    ]


@pytest.mark.parametrize("change", ["released", "expired", "revoked"])
def test_what_had_ended_is_not_ended_again(change: str) -> None:
    last = [
        told(LEASE, change=change, holder="ann", reason=""),
        told(CHANGED, state="idle", holder=None, reason=""),
        queued("dropped", 0),
    ]
    assert endings(last, 9.0) == ()


def test_each_vehicle_is_told_of_by_itself() -> None:
    last = [
        told(LEASE, "v2", change="taken", holder="ann", reason=""),
        told(LEASE, "v1", change="taken", holder="bob", reason=""),
        told(LEASE, "v3", change="released", holder="eve", reason=""),
    ]
    assert [(one.vehicle_id, one.data["holder"]) for one in endings(last, 9.0)] == [("v1", "bob"), ("v2", "ann")]


@pytest.mark.parametrize(
    ("last", "task_id"),
    [
        (queued("inserted", 1, 2, reason="prepend"), "t5"),
        (queued("paused", 1, 2), "t5"),
        (queued("changed", 1), "t5"),
        (queued("inserted", 1, 2, reason="append"), None),  # behind the first one
        (queued("reached", 1), None),  # over
        (queued("removed", 1), None),
        (queued("moved", 1, 2), None),
    ],
)
def test_of_a_dropped_queue_only_its_first_task_is_named(last: Event, task_id: str | None) -> None:
    (ended,) = endings([last], 9.0)
    assert (ended.data["task_id"], ended.data["task"]) == (task_id, task_id and CIRCLE)


async def test_a_restart_tells_the_ends_once() -> None:
    store, clock = MemoryEventStore(), SystemClock()
    lease = {"change": "taken", "holder": "ann", "reason": ""}
    await store.append([NewEvent(kind=LEASE, time=1.0, vehicle_id="v1", data=lease)])
    for _ in range(2):
        journal = Journal(store, clock)
        await journal.start()
        await tell_left_open(journal, clock)
        await journal.close()
    assert [(event.kind, event.data["change"]) for event in store.events] == [(LEASE, "taken"), (LEASE, "revoked")]
