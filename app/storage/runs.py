"""Runs on disk; implements RunStore. They are written with the events that changed them (events.py)."""

from __future__ import annotations

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.run import Run
from app.storage.database import Database
from app.storage.documents import from_json
from app.storage.schema import RUNS

_INSERT = insert(RUNS)
_UPSERT = _INSERT.on_conflict_do_update(
    index_elements=["id"],
    set_={column: _INSERT.excluded[column] for column in ("vehicle_id", "is_over", "document")},
)


async def upsert_runs(connection: AsyncConnection, runs: Sequence[Run]) -> None:
    """Store each run as it is now; of several versions of one run the last one counts."""
    newest = {run.id: run for run in runs}
    if not newest:
        return
    rows = [
        {
            "id": run.id,
            "plan_id": run.plan_id,
            "vehicle_id": run.vehicle_id,
            "is_over": run.is_over,
            "document": run.model_dump_json(),
        }
        for run in newest.values()
    ]
    await connection.execute(_UPSERT, rows)


class SqliteRunStore:
    """RunStore on one SQLite file."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def get(self, run_id: str) -> Run | None:
        """See RunStore."""
        query = sa.select(RUNS.c.id, RUNS.c.document).where(RUNS.c.id == run_id)
        rows = await self._database.read(query)
        return _run(rows[0]) if rows else None

    async def list_runs(self, *, limit: int, vehicle_id: str | None = None, open_only: bool = False) -> Sequence[Run]:
        """See RunStore."""
        query = sa.select(RUNS.c.id, RUNS.c.document).order_by(RUNS.c.position.desc()).limit(limit)
        if vehicle_id is not None:
            query = query.where(RUNS.c.vehicle_id == vehicle_id)
        if open_only:
            query = query.where(RUNS.c.is_over.is_(False))
        return tuple([_run(row) for row in await self._database.read(query)])


def _run(row: sa.RowMapping) -> Run:
    return from_json(Run, f"run {row['id']}", row["document"])
