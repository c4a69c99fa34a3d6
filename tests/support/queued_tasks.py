"""A vehicle under offboard control with tasks in its queue; it is where the test puts it."""

from __future__ import annotations

from typing import Any

from app.domain.geo import LocalProjection
from app.services.views import TaskReport
from tests.support.controlled_vehicle import ControlledVehicle
from tests.support.task_examples import task

ORIGIN = LocalProjection(47.397742, 8.545594)


def queue(
    controlled: ControlledVehicle, kind: str, mode: Any = "append", when_empty: Any = None, **changes: Any
) -> str:
    """Insert an example task; its id."""
    return controlled.tasks.insert(controlled.lease, task(kind, **changes), mode, when_empty).id


async def flying(controlled: ControlledVehicle, kind: str, **changes: Any) -> str:
    """Take the lease, queue a task, enter; the guidance speaks."""
    controlled.take()
    made = queue(controlled, kind, **changes)
    await controlled.enter()
    await controlled.ticks(2)
    return made


def put_at(controlled: ControlledVehicle, north_m: float, east_m: float, **more: object) -> None:
    """The vehicle is there."""
    latitude, longitude = ORIGIN.to_global(east_m, north_m)
    controlled.vehicle.put(latitude_deg=latitude, longitude_deg=longitude, **more)


def report(controlled: ControlledVehicle) -> TaskReport:
    return controlled.tasks.view().report


async def changes(controlled: ControlledVehicle) -> list[tuple[str, str | None]]:
    """What the events say of the queue."""
    return [(event["change"], event["task_id"]) for event in await controlled.recorded("task.changed")]


def author(controlled: ControlledVehicle) -> str | None:
    sent = controlled.control.view().sent
    return None if sent is None else sent.source
