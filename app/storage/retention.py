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
PLANS_AT_ONCE: Final = 100
MARGIN_S: Final = 60.0
"""Documents get their times a moment before their events."""
FILE_MARGIN_S: Final = 3600.0
"""Of a file's own time, which another clock may have set."""

_OLD: Final = "SELECT seq, kind, run_id, data FROM events WHERE seq <= ? ORDER BY seq LIMIT ?"
_WHOLE_RUN: Final = f"SELECT 1 FROM events WHERE run_id = ? AND kind IN ({', '.join('?' * len(WHOLE_RUN))}) LIMIT 1"
_ENDED_JOB: Final = "SELECT document FROM jobs WHERE id = ? AND is_over = 1"
_OLDEST: Final = "SELECT time FROM events ORDER BY seq LIMIT 1"
_UNUSED_PLANS: Final = (
    "SELECT id FROM plans WHERE created_at < ? AND id NOT IN (SELECT value FROM json_each(?)) "
    "AND NOT EXISTS (SELECT 1 FROM runs WHERE plan_id = plans.id) "
    "AND NOT EXISTS (SELECT 1 FROM jobs WHERE plan_id = plans.id) "
    # a change that is on its way to the vehicle names its plan
    "AND NOT EXISTS (SELECT 1 FROM runs WHERE is_over = 0 AND instr(document, plans.id)) LIMIT ?"
)


class SqliteRetentionStore:
    """RetentionStore on one SQLite file and the folder of its attachments."""

    def __init__(self, database: Database, gateway_id: str, attachments: DiskAttachmentStore) -> None:
        self._database = database
        self._gateway_id = gateway_id
        self._attachments = attachments

    async def oldest_open(self) -> tuple[str, float] | None:
        """See RetentionStore."""
        created_at = sa.func.json_extract(JOBS.c.document, "$.created_at").label("created_at")
        jobs = sa.select(JOBS.c.id, created_at).where(JOBS.c.is_over.is_(False))
        runs = sa.select(RUNS.c.id, RUNS.c.created_at).where(RUNS.c.is_over.is_(False))
        either = sa.union_all(jobs, runs).subquery()
        for row in await self._database.read(sa.select(either).order_by(either.c.created_at).limit(1)):
            return row["id"], row["created_at"]
        return None

    async def first_younger(self, *, before: float) -> tuple[int, float] | None:
        """See RetentionStore."""
        younger = sa.select(EVENTS.c.seq, EVENTS.c.time).where(EVENTS.c.time >= before)
        for row in await self._database.read(younger.order_by(EVENTS.c.seq).limit(1)):
            return row["seq"], row["time"]
        return None

    async def prunable(self, *, before: float, up_to: int) -> PrunedTo | None:
        """See RetentionStore."""
        if (oldest := await self.oldest_open()) is not None:
            before = min(before, oldest[1] - MARGIN_S)
        of_open = EVENTS.c.run_id.in_(sa.select(RUNS.c.id).where(RUNS.c.is_over.is_(False)))
        if (younger := await self.first_younger(before=before)) is not None:
            up_to = min(up_to, younger[0] - 1)
        for row in await self._database.read(sa.select(sa.func.min(EVENTS.c.seq).label("seq")).where(of_open)):
            if row["seq"] is not None:
                up_to = min(up_to, row["seq"] - 1)
        head = sa.select(EVENTS.c.seq, EVENTS.c.hash).where(EVENTS.c.seq == up_to)
        for row in await self._database.read(head):
            return PrunedTo(up_to, (PrunedChain(gateway=self._gateway_id, **row),))
        return None

    async def prune(self, pruned: JournalPruned) -> bool:
        """See RetentionStore."""
        return await self._database.append(lambda connection: _prune(connection, pruned.up_to))

    async def delete_plans(self, *, before: float, spared: Sequence[str]) -> bool:
        """See RetentionStore."""
        return await self._database.append(lambda connection: _delete_plans(connection, before, spared))

    async def has_attachments(self, *, before: float) -> bool:
        """See RetentionStore. The time of a file is when it was last attached."""
        return await self._attachments.has_older(before - FILE_MARGIN_S)

    async def delete_attachments(self, *, before: float) -> None:
        """See RetentionStore."""
        await self._attachments.delete_older(before - FILE_MARGIN_S)


def _prune(connection: sqlite3.Connection, up_to: int) -> bool:
    events = connection.execute(_OLD, (up_to, EVENTS_AT_ONCE + 1)).fetchall()
    if not events:
        return False
    if events[-1][0] < up_to:  # the last one is never left alone: only with the one before it is its content proven
        events = events[:EVENTS_AT_ONCE]
    connection.execute("DELETE FROM events WHERE seq <= ?", (events[-1][0],))
    for run_id in {run_id for _, kind, run_id, _ in events if kind in WHOLE_RUN}:
        _delete_run(connection, run_id)
    for _, kind, _, data in events:
        if kind == EventKind.JOB_CHANGED:
            _delete_job(connection, json.loads(data)["job"])
    return True


def _delete_run(connection: sqlite3.Connection, run_id: str) -> None:
    """Delete a run that has ended, unless its end is in an event that is left."""
    if connection.execute(_WHOLE_RUN, (run_id, *WHOLE_RUN)).fetchone():
        return
    if connection.execute("DELETE FROM runs WHERE id = ? AND is_over = 1", (run_id,)).rowcount:
        connection.execute("DELETE FROM flight_inputs WHERE run_id = ?", (run_id,))


def _delete_job(connection: sqlite3.Connection, job: Mapping[str, Any]) -> None:
    """Delete a job that has ended, unless it is another one by now."""
    for (document,) in connection.execute(_ENDED_JOB, (job["id"],)).fetchall():
        if json.loads(document) == job:
            connection.execute("DELETE FROM jobs WHERE id = ?", (job["id"],))


def _delete_plans(connection: sqlite3.Connection, before: float, spared: Sequence[str]) -> bool:
    for (oldest,) in connection.execute(_OLDEST):
        before = min(before, oldest - MARGIN_S)  # the events of younger ones are kept
    unused = connection.execute(_UNUSED_PLANS, (before, json.dumps(spared), PLANS_AT_ONCE)).fetchall()
    connection.executemany("DELETE FROM plans WHERE id = ?", unused)
    return bool(unused)
