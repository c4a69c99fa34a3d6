"""A run whose plan is changed in flight: what is sent, what is followed, and what is refused."""

from __future__ import annotations

import asyncio
import copy
from collections.abc import Callable
from typing import Any

from app.domain.plan import parse_plan
from app.domain.run.run import RunState
from app.domain.vehicle.state import LandedState
from tests.support.run_service import RunService

Document = dict[str, Any]


def store(service: RunService, change: Callable[[Document], None], plan_id: str = "plan-2") -> str:
    """A changed copy of the run's plan, stored under another id."""
    document = copy.deepcopy(service.plan.model_dump(mode="json"))
    change(document)
    plan = parse_plan(document)
    service.plans.add(plan, plan_id)
    return plan_id


def item(document: Document, item_id: str) -> Document:
    return next(one for one in document["items"] if one["id"] == item_id)


def clinic_moved(document: Document) -> None:
    item(document, "clinic")["latitude_deg"] = 47.398700


async def begun(
    service: RunService, change: Callable[[Document], None] = clinic_moved, *, needed: tuple[str, ...] = ()
) -> asyncio.Task[Any]:
    """A change that is recorded, and whose upload waits for the vehicle's gate."""
    service.vehicle.upload_gate.clear()
    changing = asyncio.create_task(
        service.runs.change_mission(service.run_id, store(service, change), None, "ann", needed)
    )
    await service.until(lambda: service.vehicle.waits_at_gate, "all that could refuse it was looked at")
    assert service.run.changing is not None, "what is sent must be recorded first"
    return changing


async def fly(service: RunService, item_id: str = "corner") -> None:
    """In the air, on the way to an item."""
    await service.create()
    await service.until_state(RunState.FLYING)
    seq = service.mission.seqs_of(item_id)[0]
    service.vehicle.put(mission_seq=seq, landed=LandedState.IN_AIR, relative_altitude_m=15.0)
    await service.until(lambda: service.run.item_id == item_id, "progress must show")
