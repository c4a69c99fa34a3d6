"""Plans on disk; implements PlanStore. They are written with the events that announce them (events.py)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import sqlalchemy as sa

from app.domain.ports import StoredPlan
from app.domain.vehicle import VehicleType
from app.storage.database import Database
from app.storage.documents import object_from_json, to_json, unreadable
from app.storage.schema import PLANS


def plan_row(plan: StoredPlan) -> dict[str, Any]:
    """The plan as a row; events.py stores it with its event. Raises InvalidInputError if it is not JSON."""
    document = to_json(f"plan {plan.id}", plan.document)
    return asdict(plan) | {"vehicle_type": plan.vehicle_type.value, "document": document}


class SqlitePlanStore:
    """PlanStore on one SQLite file."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def get(self, plan_id: str) -> StoredPlan | None:
        """See PlanStore."""
        rows = await self._database.read(sa.select(PLANS).where(PLANS.c.id == plan_id))
        return _stored(rows[0]) if rows else None

    async def list_plans(self, *, limit: int) -> Sequence[StoredPlan]:
        """See PlanStore."""
        query = sa.select(PLANS).order_by(PLANS.c.position.desc()).limit(limit)
        return tuple([_stored(row) for row in await self._database.read(query)])


def _stored(row: sa.RowMapping) -> StoredPlan:
    try:
        return StoredPlan(
            id=row["id"],
            hash=row["hash"],
            name=row["name"],
            vehicle_type=VehicleType(row["vehicle_type"]),
            created_at=row["created_at"],
            created_by=row["created_by"],
            document=object_from_json(f"plan {row['id']}", row["document"]),
        )
    except ValueError as error:
        raise unreadable(f"plan {row['id']}") from error
