"""Deletes what is old from a journal file and its attachments; implements RetentionStore."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping, Sequence
from typing import Any, Final

import sqlalchemy as sa

from app.domain.events import EventKind
from app.domain.events.run_fold import WHOLE_RUN
from app.domain.events.service import JournalPruned, PrunedChain
from app.domain.ports.stores import PrunedTo
from app.storage.attachments import DiskAttachmentStore
from app.storage.database import Database
from app.storage.schema import EVENTS, JOBS, RUNS

EVENTS_AT_ONCE: Final = 200
"""In one transaction: what is recorded meanwhile waits for it."""
MARGIN_S: Final = 60.0
"""Documents get their times a moment before their events."""
FILE_MARGIN_S: Final = 3600.0
"""Of a file's own time, which another clock may have set."""

_OLD: Final = "SELECT seq, kind, run_id, data FROM events WHERE seq <= ? ORDER BY seq LIMIT ?"
_WHOLE_RUN: Final = f"SELECT 1 FROM events WHERE run_id = ? AND kind IN ({', '.join('?' * len(WHOLE_RUN))}) LIMIT 1"
_ENDED_RUN: Final = "SELECT plan_id FROM runs WHERE id = ? AND is_over = 1"
_ENDED_JOB: Final = "SELECT plan_id, document FROM jobs WHERE id = ? AND is_over = 1"
_UNUSED_PLAN: Final = (
    "SELECT 1 FROM plans WHERE id = ?1 AND NOT EXISTS (SELECT 1 FROM runs WHERE plan_id = ?1) "
    "AND NOT EXISTS (SELECT 1 FROM jobs WHERE plan_id = ?1)"
)


class SqliteRetentionStore:
    """RetentionStore on one SQLite file and the folder of its attachments."""

    def __init__(self, database: Database, gateway_id: str, attachments: DiskAttachmentStore) -> None:
        self._database = database
        self._gateway_id = gateway_id
        self._attachments = attachments

    async def prunable(self, *, before: float, up_to: int) -> PrunedTo | None:
        """See RetentionStore."""
        open_jobs = sa.select(sa.func.json_extract(JOBS.c.document, "$.created_at")).where(JOBS.c.is_over.is_(False))
        open_runs = sa.select(RUNS.c.created_at).where(RUNS.c.is_over.is_(False))
        for row in await self._database.read(sa.select(sa.union_all(open_jobs, open_runs).subquery())):
            before = min(before, next(iter(row.values())) - MARGIN_S)
        of_open = EVENTS.c.run_id.in_(sa.select(RUNS.c.id).where(RUNS.c.is_over.is_(False)))
        kept = (
            sa.select(EVENTS.c.seq).where(EVENTS.c.time >= before).order_by(EVENTS.c.seq).limit(1),
            sa.select(sa.func.min(EVENTS.c.seq).label("seq")).where(of_open),
        )
        for query in kept:
            for row in await self._database.read(query):
                if row["seq"] is not None:
                    up_to = min(up_to, row["seq"] - 1)
        head = sa.select(EVENTS.c.seq, EVENTS.c.hash).where(EVENTS.c.seq == up_to)
        for row in await self._database.read(head):
            return PrunedTo(up_to, (PrunedChain(gateway=self._gateway_id, **row),))
        return None

    async def prune(self, pruned: JournalPruned) -> Sequence[str] | None:
        """See RetentionStore."""
        return await self._database.append(lambda connection: _prune(connection, pruned.up_to))

    async def has_attachments(self, *, before: float) -> bool:
        """See RetentionStore. The time of a file is when it was last attached."""
        return await self._attachments.has_older(before - FILE_MARGIN_S)

    async def delete_attachments(self, *, before: float) -> None:
        """See RetentionStore."""
        await self._attachments.delete_older(before - FILE_MARGIN_S)


def _prune(connection: sqlite3.Connection, up_to: int) -> Sequence[str] | None:
    events = connection.execute(_OLD, (up_to, EVENTS_AT_ONCE + 1)).fetchall()
    if not events:
        return None
    if events[-1][0] < up_to:  # the last one is never left alone: only with the one before it is its content proven
        events = events[:EVENTS_AT_ONCE]
    connection.execute("DELETE FROM events WHERE seq <= ?", (events[-1][0],))
    plans: dict[str, None] = {}
    for _, kind, run_id, data in events:
        if kind in WHOLE_RUN:
            plans |= dict.fromkeys(_delete_run(connection, run_id))
        elif kind == EventKind.JOB_CHANGED:
            plans |= dict.fromkeys(_delete_job(connection, json.loads(data)["job"]))
        elif kind == EventKind.PLAN_CREATED:
            plans[json.loads(data)["plan_id"]] = None
    unused = [plan_id for plan_id in plans if connection.execute(_UNUSED_PLAN, (plan_id,)).fetchone()]
    connection.executemany("DELETE FROM plans WHERE id = ?", [(plan_id,) for plan_id in unused])
    return unused


def _delete_run(connection: sqlite3.Connection, run_id: str) -> Sequence[str]:
    """Delete a run that has ended, unless its end is in an event that is left; the plan that it flew."""
    if connection.execute(_WHOLE_RUN, (run_id, *WHOLE_RUN)).fetchone():
        return ()
    plans = connection.execute(_ENDED_RUN, (run_id,)).fetchall()
    if plans:
        connection.execute("DELETE FROM runs WHERE id = ?", (run_id,))
        connection.execute("DELETE FROM flight_inputs WHERE run_id = ?", (run_id,))
    return [plan_id for (plan_id,) in plans]


def _delete_job(connection: sqlite3.Connection, job: Mapping[str, Any]) -> Sequence[str]:
    """Delete a job that has ended, unless it is another one by now; its plan."""
    ended = connection.execute(_ENDED_JOB, (job["id"],)).fetchall()
    plans = [plan_id for plan_id, document in ended if json.loads(document) == job]
    if plans:
        connection.execute("DELETE FROM jobs WHERE id = ?", (job["id"],))
    return plans
