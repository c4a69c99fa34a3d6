"""Runs on disk; implements RunStore. They are written with the events that changed them (events.py)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.run import Run
from app.domain.run_filter import RunFilter
from app.storage.database import Database
from app.storage.documents import from_json
from app.storage.schema import RUNS

_INSERT = insert(RUNS)
_UPSERT = _INSERT.on_conflict_do_update(
    index_elements=["id"],
    set_={column: _INSERT.excluded[column] for column in ("plan_id", "vehicle_id", "is_over", "state", "document")},
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
            "state": run.state.value,
            "created_at": run.created_at,
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

    async def list_runs(self, wanted: RunFilter, *, limit: int) -> Sequence[Run]:
        """See RunStore."""
        query = sa.select(RUNS.c.id, RUNS.c.document).order_by(RUNS.c.position.desc()).limit(limit)
        rows = await self._database.read(query.where(*_conditions(wanted)))
        return tuple([_run(row) for row in rows])


def _conditions(wanted: RunFilter) -> Iterator[sa.ColumnElement[bool]]:
    if wanted.vehicle_id is not None:
        yield RUNS.c.vehicle_id == wanted.vehicle_id
    if wanted.plan_id is not None:
        yield RUNS.c.plan_id == wanted.plan_id
    if wanted.open_only:
        yield RUNS.c.is_over.is_(False)
    if wanted.states:
        yield RUNS.c.state.in_(sorted(state.value for state in wanted.states))
    if wanted.created_from is not None:
        yield RUNS.c.created_at >= wanted.created_from
    if wanted.created_before is not None:
        yield RUNS.c.created_at < wanted.created_before
    if wanted.older_than is not None:
        last = sa.select(RUNS.c.position).where(RUNS.c.id == wanted.older_than).scalar_subquery()
        yield RUNS.c.position < last


def _run(row: sa.RowMapping) -> Run:
    return from_json(Run, f"run {row['id']}", row["document"])
