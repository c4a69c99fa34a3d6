"""Offboard control of the whole fleet: one control for each vehicle that was ever asked for."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Final

from app.domain.events import AnyPayload, Event, EventKind, NewEvent
from app.domain.events.vehicle import OffboardChanged, OffboardLease, TasksChanged, TasksGripper
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.offboard.tasks.forms import EMPTY_LIST
from app.domain.ports.threads import InThread
from app.domain.reasons import Reason, ReasonCode
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.offboard.control import OffboardControl
from app.services.offboard.settings import OffboardSettings
from app.services.runs import Runs

RESTARTED: Final = Reason.of(ReasonCode.OFFBOARD_SERVICE_RESTARTED)
_OF_CURRENT: Final = frozenset({"paused", "resumed", "manual", "blocked"})
_OF_ANY: Final = frozenset({"inserted", "changed", "moved"})
_ENDED: Final = (EventKind.OFFBOARD_LEASE, EventKind.OFFBOARD_CHANGED, EventKind.TASK_CHANGED, EventKind.TASK_GRIPPER)
READ_AT_ONCE: Final = 500


async def recover_interrupted(journal: Journal, clock: Clock) -> None:
    """Record the ends, before any vehicle is seen: leases and queues live in the process alone. Raises StorageError."""
    last = await journal.last_offboard()
    if ended := endings((*last, *await _last_grippers(journal, last)), clock.now()):
        await journal.record(*ended)


async def _last_grippers(journal: Journal, last: Sequence[Event]) -> Sequence[Event]:
    """The newest task.gripper of each vehicle that has an open lease: no other command can be without its outcome."""
    newest: dict[str | None, Event] = {}
    leases = (event for event in last if isinstance(event.data, OffboardLease) and not event.data.change.ends)
    after = min((event.seq for event in leases), default=None)
    while after is not None and (events := await journal.read(after, READ_AT_ONCE)):
        after = events[-1].seq
        newest |= {event.vehicle_id: event for event in events if event.kind is EventKind.TASK_GRIPPER}
    return tuple(newest.values())


def endings(last: Sequence[Event], now: float) -> tuple[NewEvent, ...]:
    """The events that end what `last`, the newest of each kind per vehicle, leaves open; in the order of a normal end.

    No Hold was commanded, so none is recorded: the vehicle's own failsafe acted when the setpoints stopped.
    """
    ended: list[NewEvent] = []
    for vehicle_id in sorted({event.vehicle_id for event in last if event.vehicle_id is not None}):
        of_vehicle = {event.kind: event for event in last if event.vehicle_id == vehicle_id}
        gripped = _gripping(of_vehicle.get(EventKind.TASK_GRIPPER))
        for kind in _ENDED:
            event = of_vehicle.get(kind)
            ending = None if event is None else _ending(event.data, gripped)
            if event is not None and ending is not None:
                ended.append(NewEvent.of(ending, now, vehicle_id=vehicle_id, run_id=event.run_id))
    return tuple(ended)


def _gripping(event: Event | None) -> str | None:
    """The task whose gripper command was sent and has no outcome: until then it is the current one."""
    if event is None or not isinstance(event.data, TasksGripper) or event.data.outcome != "sent":
        return None
    return event.data.task_id


def _ending(
    payload: AnyPayload, gripping: str | None
) -> OffboardLease | OffboardChanged | TasksChanged | TasksGripper | None:
    """The payload that ends what this one began; None if it is over."""
    if isinstance(payload, TasksGripper) and gripping is not None:
        return TasksGripper(task_id=payload.task_id, action=payload.action, outcome="unknown", reason=RESTARTED)
    if isinstance(payload, OffboardLease) and not payload.change.ends:
        return OffboardLease(change=LeaseChange.REVOKED, holder=payload.holder, reason=RESTARTED)
    if isinstance(payload, OffboardChanged) and payload.state is not OffboardState.IDLE:
        return OffboardChanged(state=OffboardState.IDLE, holder=None, reason=RESTARTED)
    if isinstance(payload, TasksChanged) and payload.task_list != EMPTY_LIST:
        is_of_gripper = payload.task_id == gripping
        task_id = payload.task_id if _is_current(payload) else gripping
        task = payload.task if task_id is not None and (gripping is None or is_of_gripper) else None
        return TasksChanged(
            change="dropped", task_id=task_id, task=task, holder=None, reason=RESTARTED, task_list=EMPTY_LIST
        )
    return None


def _is_current(payload: TasksChanged) -> bool:
    """Whether the event's task is certainly the first of the queue: it may also be the last, or over."""
    is_put_first = payload.change == "inserted" and payload.insert_mode != "append"
    return payload.change in _OF_CURRENT or is_put_first or (payload.change in _OF_ANY and len(payload.task_list) == 1)


class Offboard:
    """The registry."""

    def __init__(
        self,
        fleet: Fleet,
        runs: Runs,
        clock: Clock,
        settings: OffboardSettings | None = None,
        in_thread: InThread = asyncio.to_thread,
    ) -> None:
        self._fleet = fleet
        self._runs = runs
        self._clock = clock
        self._in_thread = in_thread
        self.settings = settings or OffboardSettings()
        self._vehicles: dict[str, OffboardControl] = {}

    def vehicle(self, vehicle_id: str) -> OffboardControl:
        """One vehicle. Raises NotFoundError."""
        vehicle = self._fleet.vehicle(vehicle_id)
        if vehicle_id not in self._vehicles:
            control = OffboardControl(vehicle, self._fleet, self._runs, self._clock, self.settings, self._in_thread)
            self._vehicles[vehicle_id] = control
        return self._vehicles[vehicle_id]

    async def close(self) -> None:
        """Hold each vehicle in offboard control, and stop. Idempotent."""
        vehicles, self._vehicles = tuple(self._vehicles.values()), {}
        await asyncio.gather(*(one.close() for one in vehicles))
