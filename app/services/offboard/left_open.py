"""What an earlier process left open in the journal: after a kill the next one tells how flying by hand has ended."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from app.domain.events import Event, EventKind, NewEvent
from app.domain.tasks.forms import EMPTY_LIST
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.offboard_view import OffboardState

RESTARTED: Final = "the service was restarted"
_LEASE_GOES_ON: Final = frozenset({"taken", "handed_over", "overridden", "offered"})
_OF_CURRENT: Final = frozenset({"paused", "resumed", "by_hand", "blocked"})
_OF_ANY: Final = frozenset({"inserted", "changed", "moved"})


async def tell_left_open(journal: Journal, clock: Clock) -> None:
    """Record the ends, before any vehicle is seen: leases and queues live in the process alone. Raises StorageError."""
    if ended := endings(await journal.last_by_hand(), clock.now()):
        await journal.record(*ended)


def endings(last: Sequence[Event], now: float) -> tuple[NewEvent, ...]:
    """The events that end what `last`, the newest of each kind per vehicle, leaves open; in the order of a normal end.

    No Hold was commanded, so none is told: the vehicle's own failsafe acted when the setpoints stopped.
    """
    ended: list[NewEvent] = []
    for vehicle_id in sorted({event.vehicle_id for event in last if event.vehicle_id is not None}):
        of_vehicle = {event.kind: event for event in last if event.vehicle_id == vehicle_id}
        for kind in (EventKind.OFFBOARD_LEASE, EventKind.OFFBOARD_CHANGED, EventKind.TASKS_CHANGED):
            told = of_vehicle.get(kind)
            data = None if told is None else _ending(told)
            if told is not None and data is not None:
                ended.append(NewEvent(kind=kind, time=now, vehicle_id=vehicle_id, run_id=told.run_id, data=data))
    return tuple(ended)


def _ending(told: Event) -> dict[str, Any] | None:
    """The data of the event that ends what this one tells; None if it is over."""
    match told.kind:
        case EventKind.OFFBOARD_LEASE if told.data.get("change") in _LEASE_GOES_ON:
            return {"change": "revoked", "holder": told.data.get("holder"), "reason": RESTARTED}
        case EventKind.OFFBOARD_CHANGED if told.data.get("state") != OffboardState.IDLE:
            return {"state": OffboardState.IDLE.value, "holder": None, "reason": RESTARTED}
        case EventKind.TASKS_CHANGED if told.data.get("task_list", list(EMPTY_LIST)) != list(EMPTY_LIST):
            task_id, task = (told.data.get("task_id"), told.data.get("task")) if _is_current(told) else (None, None)
            gone = {"holder": None, "reason": RESTARTED, "task_list": list(EMPTY_LIST)}
            return {"change": "dropped", "task_id": task_id, "task": task, **gone}
        case _:
            return None


def _is_current(told: Event) -> bool:
    """Whether the task that is told of is surely the first of the queue: one told of may also be the last, or over."""
    change, is_alone = told.data.get("change"), len(told.data["task_list"]) == 1
    is_put_first = change == "inserted" and told.data.get("reason") != "append"
    return change in _OF_CURRENT or is_put_first or (change in _OF_ANY and is_alone)
