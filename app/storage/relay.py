"""The journal as it is sent to a cluster: rows of events and documents, not parsed; implements RelayLog."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Collection, Iterable, Sequence
from typing import Any, Final

import sqlalchemy as sa

from app.domain.cluster.envelope import Envelope, RelayedEvent, Row
from app.domain.events import EventKind
from app.domain.events.event import JournalHead
from app.domain.events.service import JournalPruned
from app.storage.database import Database
from app.storage.schema import EVENTS, JOB_QUEUES, JOBS, PLANS, RUNS

_COLUMNS: Final = tuple(EVENTS.c.keys())
_LAST_SEQ: Final = "SELECT coalesce(max(seq), 0) FROM events"
_NEWEST_PRUNED: Final = "SELECT data FROM events WHERE kind = 'journal.pruned' ORDER BY seq DESC LIMIT 1"
_PAGE: Final = f"SELECT {', '.join(_COLUMNS)} FROM events WHERE seq > ? ORDER BY seq LIMIT ?"


PLAN_KEPT_S: Final = 43_200.0
"""So long a cluster keeps a plan that nothing uses, however short its retention is; less, for clocks that differ.
What a gateway sends after an absence may be older than that, whatever the time between a plan and its run.
"""
_OLD_PLANS: Final = """
SELECT plans.id FROM jobs JOIN plans ON plans.id = jobs.plan_id
WHERE jobs.id IN (SELECT value FROM json_each(:jobs))
    AND plans.created_at < max(:before, strftime('%s', 'now') - :kept_s)
UNION SELECT plans.id FROM runs JOIN plans ON plans.id = runs.plan_id
WHERE runs.id IN (SELECT value FROM json_each(:begun))
    AND plans.created_at < max(:before, strftime('%s', 'now') - :kept_s)
    OR runs.id IN (SELECT value FROM json_each(:runs)) AND runs.created_at < :before
"""


class SqliteRelayLog:
    """RelayLog on one SQLite file."""

    def __init__(self, database: Database, gateway_id: str) -> None:
        self._database = database
        self._gateway_id = gateway_id

    async def envelope(self, site: str, *, after: int, limit: int) -> Envelope:
        def read(connection: sqlite3.Connection) -> Envelope:
            pruned = _pruned(connection)
            start = None
            if pruned is not None and after < pruned.up_to:
                start = JournalHead(seq=pruned.up_to, hash=pruned.chains[0].hash)
            page = connection.execute(_PAGE, (after if start is None else start.seq, limit))
            events = [RelayedEvent(**dict(zip(_COLUMNS, row, strict=True))) for row in page]
            naming = [(event.kind, json.loads(event.data)) for event in events if event.kind in _NAMES_DOCUMENTS]
            plans = _named(naming, EventKind.PLAN_CREATED, "plan_id")
            plans |= _named(naming, EventKind.RUN_MISSION_CHANGED, "change", "plan_id")
            jobs = _named(naming, EventKind.JOB_CHANGED, "job", "id")
            queues = _named(naming, EventKind.JOB_QUEUE_CHANGED, "queue", "vehicle_id")
            if start is not None:  # nothing else tells of queues that were stopped before
                queues |= {vehicle_id for (vehicle_id,) in connection.execute("SELECT vehicle_id FROM job_queues")}
            runs = {event.run_id for event in events if event.run_id is not None}
            begun = {event.run_id for event in events if event.kind == EventKind.RUN_CREATED and event.run_id}
            plans |= _old_plans(connection, pruned, jobs=jobs, runs=runs, begun=begun)
            return Envelope(
                site=site,
                gateway=self._gateway_id,
                as_of=connection.execute(_LAST_SEQ).fetchone()[0],
                events=tuple(events),
                plans=_rows(connection, PLANS, "id", plans),
                runs=_rows(connection, RUNS, "id", runs),
                jobs=_rows(connection, JOBS, "id", jobs),
                queues=_rows(connection, JOB_QUEUES, "vehicle_id", queues),
                start=start,
            )

        return await self._database.read_at_once(read)


def _pruned(connection: sqlite3.Connection) -> JournalPruned | None:
    row = connection.execute(_NEWEST_PRUNED).fetchone()
    return None if row is None else JournalPruned.model_validate_json(row[0])


def _old_plans(connection: sqlite3.Connection, pruned: JournalPruned | None, **of: Collection[str]) -> set[str]:
    """The plans of jobs, of runs that begin, and of those that had begun in deleted events, if the plan's own event
    was deleted here or may have been deleted in the cluster: nothing else tells the cluster of them.
    """
    if not any(of.values()):
        return set()
    ids = {name: json.dumps(list(wanted)) for name, wanted in of.items()}
    before = 0.0 if pruned is None else pruned.before or 0.0
    rows = connection.execute(_OLD_PLANS, {**ids, "before": before, "kept_s": PLAN_KEPT_S})
    return {plan_id for (plan_id,) in rows}


def _rows(connection: sqlite3.Connection, table: sa.Table, key: str, ids: Iterable[str]) -> tuple[Row, ...]:
    wanted = sorted(ids)
    if not wanted:
        return ()
    columns = [column for column in table.c if column.name != "position"]
    names = ", ".join(column.name for column in columns)
    query = f"SELECT {names} FROM {table.name} WHERE {key} IN ({', '.join('?' * len(wanted))})"
    return tuple(
        [
            {
                column.name: bool(value) if isinstance(column.type, sa.Boolean) else value
                for column, value in zip(columns, row, strict=True)
            }
            for row in connection.execute(query, wanted)
        ]
    )


_NAMES_DOCUMENTS = (
    EventKind.PLAN_CREATED,
    EventKind.RUN_MISSION_CHANGED,
    EventKind.JOB_CHANGED,
    EventKind.JOB_QUEUE_CHANGED,
)


def _named(events: Sequence[tuple[str, Any]], kind: EventKind, *path: str) -> set[str]:
    found = set()
    for of, data in events:
        if of == kind:
            for step in path:
                data = data[step]
            found.add(str(data))
    return found
