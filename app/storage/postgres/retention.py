"""Deletes what is old from a cluster's store; implements RetentionStore."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Final

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.events import EventKind
from app.domain.events.run_fold import WHOLE_RUN
from app.domain.events.service import JournalPruned, PrunedChain
from app.domain.ports.stores import PrunedTo
from app.storage.postgres.database import PostgresDatabase
from app.storage.retention import EVENTS_AT_ONCE, FILE_MARGIN_S, MARGIN_S, PLANS_AT_ONCE

EVENTS_IN_ROUND: Final = 500_000
"""What is looked through and deleted in one round: a statement must end in time, however much is old at the first."""
FILES_AT_ONCE: Final = 20

_OLDEST_OPEN: Final = sa.text(
    "SELECT id, created_at FROM (SELECT id, created_at FROM runs WHERE NOT is_over UNION ALL "
    "SELECT id, (document::json ->> 'created_at')::double precision FROM jobs WHERE NOT is_over) "
    "AS open (id, created_at) ORDER BY created_at LIMIT 1"
)
_FIRST_YOUNGER: Final = sa.text(
    "SELECT position, time FROM events WHERE position < (SELECT min(position) + :most FROM events) "
    "AND time >= :before ORDER BY position LIMIT 1"
)
_FIRST_KEPT: Final = sa.text(
    "WITH oldest AS (SELECT min(position) + :most AS beyond FROM events) SELECT least(beyond, "
    "(SELECT position FROM events WHERE position < beyond AND time >= :before ORDER BY position LIMIT 1), "
    "(SELECT min(position) FROM events WHERE run_id IN (SELECT id FROM runs WHERE NOT is_over))) FROM oldest"
)
_HEADS: Final = sa.text(
    "SELECT gateway, seq, hash FROM events JOIN "
    "(SELECT gateway, max(seq) AS seq FROM events WHERE position <= :up_to GROUP BY gateway) AS newest "
    "USING (gateway, seq) ORDER BY gateway"
)
_DELETE_EVENTS: Final = sa.text(
    "DELETE FROM events WHERE position > :deleted AND position <= "
    "least(:up_to, (SELECT min(position) FROM events WHERE position > :deleted) + :most - 1) "
    "RETURNING position, kind, run_id, data"
)
_DELETE_RUNS: Final = sa.text(
    "DELETE FROM runs WHERE id = ANY(:ids) AND is_over AND NOT EXISTS "
    "(SELECT 1 FROM events WHERE run_id = runs.id AND kind = ANY(:whole_run))"
)
_DELETE_JOB: Final = sa.text(
    "DELETE FROM jobs WHERE id = :id AND is_over AND document::jsonb = CAST(:document AS jsonb)"
)
_WITHOUT_APPENDS: Final = sa.text("SELECT position FROM stream FOR UPDATE")
_DELETE_PLANS: Final = sa.text(
    "DELETE FROM plans WHERE id IN (SELECT id FROM plans AS old WHERE created_at < "
    "least(:before, (SELECT time - :margin_s FROM events ORDER BY position LIMIT 1)) AND id <> ALL(:spared) "
    "AND NOT EXISTS (SELECT 1 FROM runs WHERE plan_id = old.id) "
    "AND NOT EXISTS (SELECT 1 FROM jobs WHERE plan_id = old.id) "
    "AND NOT EXISTS (SELECT 1 FROM runs WHERE NOT is_over AND strpos(document, old.id) > 0) LIMIT :most)"
)
_HAS_FILES: Final = sa.text("SELECT EXISTS (SELECT 1 FROM attachments WHERE attached_at < :before)")
_DELETE_FILES: Final = sa.text(
    "DELETE FROM attachments WHERE attached_at < :before AND sha256 IN "
    "(SELECT sha256 FROM attachments WHERE attached_at < :before LIMIT :most)"
)


class PostgresRetentionStore:
    """RetentionStore in PostgreSQL, by positions. Files that were attached on a gateway are deleted there."""

    def __init__(self, database: PostgresDatabase) -> None:
        self._database = database
        self._deleted = 0  # rows that were deleted are passed over one by one until PostgreSQL has cleaned up

    async def oldest_open(self) -> tuple[str, float] | None:
        """See RetentionStore."""
        return await self._database.transact(_oldest_open)

    async def first_younger(self, *, before: float) -> tuple[int, float] | None:
        """See RetentionStore; of the events of one round."""

        async def look(connection: AsyncConnection) -> tuple[int, float] | None:
            limits = {"before": before, "most": EVENTS_IN_ROUND}
            row = (await connection.execute(_FIRST_YOUNGER, limits)).one_or_none()
            return None if row is None else (row.position, row.time)

        return await self._database.transact(look)

    async def prunable(self, *, before: float, up_to: int) -> PrunedTo | None:
        """See RetentionStore."""

        async def look(connection: AsyncConnection) -> PrunedTo | None:
            oldest = await _oldest_open(connection)
            kept_from = before if oldest is None else min(before, oldest[1] - MARGIN_S)
            first_kept = (
                await connection.execute(_FIRST_KEPT, {"before": kept_from, "most": EVENTS_IN_ROUND})
            ).scalar_one()
            last = up_to if first_kept is None else min(up_to, first_kept - 1)
            heads = (await connection.execute(_HEADS, {"up_to": last})).mappings().all()
            return PrunedTo(last, tuple(PrunedChain(**head) for head in heads)) if heads else None

        return await self._database.transact(look)

    async def prune(self, pruned: JournalPruned) -> bool:
        """See RetentionStore."""

        async def prune(connection: AsyncConnection) -> int | None:
            limits = {"deleted": self._deleted, "up_to": pruned.up_to, "most": EVENTS_AT_ONCE}
            events = (await connection.execute(_DELETE_EVENTS, limits)).mappings().all()
            await _delete_documents(connection, events)
            return max((event["position"] for event in events), default=None)

        last = await self._database.transact(prune)
        self._deleted = last or self._deleted
        return last is not None

    async def delete_plans(self, *, before: float, spared: Sequence[str]) -> bool:
        """See RetentionStore. A run or job that is stored at this moment waits, and brings its plan."""
        old = {"before": before, "margin_s": MARGIN_S, "spared": list(spared), "most": PLANS_AT_ONCE}

        async def delete(connection: AsyncConnection) -> bool:
            await connection.execute(_WITHOUT_APPENDS)
            return (await connection.execute(_DELETE_PLANS, old)).rowcount > 0

        return await self._database.transact(delete)

    async def has_attachments(self, *, before: float) -> bool:
        """See RetentionStore."""

        async def look(connection: AsyncConnection) -> bool:
            return bool((await connection.execute(_HAS_FILES, {"before": before - FILE_MARGIN_S})).scalar_one())

        return await self._database.transact(look)

    async def delete_attachments(self, *, before: float) -> None:
        """See RetentionStore."""
        limits = {"before": before - FILE_MARGIN_S, "most": FILES_AT_ONCE}

        async def delete(connection: AsyncConnection) -> int:
            return (await connection.execute(_DELETE_FILES, limits)).rowcount

        while await self._database.transact(delete):
            pass


async def _delete_documents(connection: AsyncConnection, events: Sequence[sa.RowMapping]) -> None:
    """Delete the runs and jobs that have ended with the deleted events."""
    runs = sorted({event["run_id"] for event in events if event["kind"] in WHOLE_RUN})
    if runs:
        await connection.execute(_DELETE_RUNS, {"ids": runs, "whole_run": [kind.value for kind in WHOLE_RUN]})
    for event in events:
        if event["kind"] == EventKind.JOB_CHANGED:
            job = json.loads(event["data"])["job"]
            await connection.execute(_DELETE_JOB, {"id": job["id"], "document": json.dumps(job)})


async def _oldest_open(connection: AsyncConnection) -> tuple[str, float] | None:
    row = (await connection.execute(_OLDEST_OPEN)).one_or_none()
    return None if row is None else (row.id, row.created_at)
