"""`verify-journal` shows whatever was altered behind Waydrop's back, and nothing else."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from app.domain.drop.record import DropOutcome
from app.domain.events import AnyPayload, NewEvent
from app.domain.events.run import RunCreated, RunDrop
from app.domain.events.service import PlanCreated
from app.domain.plan.document import document_hash
from app.domain.ports.stores import StoredPlan
from app.storage import open_storage
from tests.support.stored_samples import event, plan, run

DOCUMENT = {"version": 1, "name": "clinic run 1", "vehicle_type": "multicopter"}
TRIGGERS = ("events_are_gapless", "events_never_change", "events_go_by_age", "plans_never_change", "plans_go_by_age")


async def write_journal(path: Path) -> None:
    stored = replace(plan(), hash=document_hash(DOCUMENT), document=DOCUMENT)
    flown = run().model_copy(update={"plan_hash": stored.hash})
    done = flown.drops[0].model_copy(update={"outcome": DropOutcome.RELEASED})
    async with open_storage(path) as storage:
        await storage.events.append([event(1), event(2, item_id="größe ☂"), event(3)])
        await storage.events.append([new_event(announced(stored))], plans=[stored])
        await storage.events.append([new_event(RunCreated(flown))], [flown])
        await storage.events.append([new_event(RunDrop(done))], [flown.with_drop(done, now=2000.0)])


def announced(stored: StoredPlan) -> PlanCreated:
    """As services/plans.py does it."""
    return PlanCreated(
        plan_id=stored.id,
        hash=stored.hash,
        name=stored.name,
        vehicle_type=stored.vehicle_type,
        created_at=stored.created_at,
        created_by=stored.created_by,
    )


def new_event(payload: AnyPayload) -> NewEvent:
    run_id = None if isinstance(payload, PlanCreated) else "run-1"
    return NewEvent.of(payload, 1000.25, vehicle_id="v1", run_id=run_id)


def alter(path: Path, *statements: str) -> None:
    """As somebody with a SQLite shell would."""
    with closing(sqlite3.connect(path)) as connection:
        for trigger in TRIGGERS:
            connection.execute(f"DROP TRIGGER IF EXISTS {trigger}")
        for statement in statements:
            connection.execute(statement)
        connection.commit()
