"""A vehicle under offboard control with tasks in its queue; it is where the test puts it."""

from __future__ import annotations

from typing import Any

from app.domain.geo import LocalProjection
from app.services.views import TaskReport
from tests.support.offboard_fixture import Cockpit
from tests.support.task_examples import task

ORIGIN = LocalProjection(47.397742, 8.545594)


def queue(cockpit: Cockpit, kind: str, mode: Any = "append", when_empty: Any = None, **changes: Any) -> str:
    """Insert an example task; its id."""
    return cockpit.desk.insert(cockpit.lease, task(kind, **changes), mode, when_empty).id


async def flying(cockpit: Cockpit, kind: str, **changes: Any) -> str:
    """Take the lease, queue a task, enter; the guidance speaks."""
    cockpit.take()
    made = queue(cockpit, kind, **changes)
    await cockpit.enter()
    await cockpit.ticks(2)
    return made


def put_at(cockpit: Cockpit, north_m: float, east_m: float, **more: object) -> None:
    """The vehicle is there."""
    latitude, longitude = ORIGIN.to_global(east_m, north_m)
    cockpit.vehicle.put(latitude_deg=latitude, longitude_deg=longitude, **more)


def report(cockpit: Cockpit) -> TaskReport:
    return cockpit.desk.view().report


async def changes(cockpit: Cockpit) -> list[tuple[str, str | None]]:
    """What the events say of the queue."""
    return [(event["change"], event["task_id"]) for event in await cockpit.told("task.changed")]


def author(cockpit: Cockpit) -> str | None:
    sent = cockpit.control.view().sent
    return None if sent is None else sent.source
