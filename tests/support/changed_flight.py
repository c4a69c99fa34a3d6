"""A run whose plan is changed in flight: what is sent, what is followed, and what is refused."""

from __future__ import annotations

import asyncio
import copy
from collections.abc import Callable
from typing import Any

from app.domain.plan import parse_plan
from app.domain.run.run import RunState
from app.domain.vehicle.state import LandedState
from tests.support.runs_fixture import Desk

Document = dict[str, Any]


def store(at: Desk, change: Callable[[Document], None], plan_id: str = "plan-2") -> str:
    """A changed copy of the run's plan, stored under another id."""
    document = copy.deepcopy(at.plan.model_dump(mode="json"))
    change(document)
    plan = parse_plan(document)
    at.plans.add(plan, plan_id)
    return plan_id


def item(document: Document, item_id: str) -> Document:
    return next(one for one in document["items"] if one["id"] == item_id)


def clinic_moved(document: Document) -> None:
    item(document, "clinic")["latitude_deg"] = 47.398700


async def begun(
    at: Desk, change: Callable[[Document], None] = clinic_moved, *, needed: tuple[str, ...] = ()
) -> asyncio.Task[Any]:
    """A change that is recorded, and whose upload waits for the vehicle's gate."""
    at.vehicle.upload_gate.clear()
    changing = asyncio.create_task(at.runs.change_mission(at.run_id, store(at, change), None, "ann", needed))
    await at.until(lambda: at.vehicle.waits_at_gate, "all that could refuse it was looked at")
    assert at.run.changing is not None, "what is sent must be recorded first"
    return changing


async def fly(at: Desk, item_id: str = "corner") -> None:
    """In the air, on the way to an item."""
    await at.create()
    await at.until_state(RunState.FLYING)
    seq = at.mission.seqs_of(item_id)[0]
    at.vehicle.put(mission_seq=seq, landed=LandedState.IN_AIR, relative_altitude_m=15.0)
    await at.until(lambda: at.run.item_id == item_id, "progress must show")
