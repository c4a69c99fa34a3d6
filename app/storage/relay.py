"""The journal as it is sent to a cluster: rows of events and documents, not parsed; implements RelayLog."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Sequence
from typing import Any, Final

import sqlalchemy as sa

from app.domain.cluster.envelope import Envelope, RelayedEvent, Row
from app.domain.events import EventKind
from app.storage.database import Database
from app.storage.schema import EVENTS, JOB_QUEUES, JOBS, PLANS, RUNS

_COLUMNS: Final = tuple(EVENTS.c.keys())
_LAST_SEQ: Final = "SELECT coalesce(max(seq), 0) FROM events"
_PAGE: Final = f"SELECT {', '.join(_COLUMNS)} FROM events WHERE seq > ? ORDER BY seq LIMIT ?"


class SqliteRelayLog:
    """RelayLog on one SQLite file."""

    def __init__(self, database: Database, gateway_id: str) -> None:
        self._database = database
        self._gateway_id = gateway_id

    async def envelope(self, site: str, *, after: int, limit: int) -> Envelope:
        def read(connection: sqlite3.Connection) -> Envelope:
            page = connection.execute(_PAGE, (after, limit))
            events = [RelayedEvent(**dict(zip(_COLUMNS, row, strict=True))) for row in page]
            naming = [(event.kind, json.loads(event.data)) for event in events if event.kind in _NAMES_DOCUMENTS]
            plans = _named(naming, EventKind.PLAN_CREATED, "plan_id")
            jobs = _named(naming, EventKind.JOB_CHANGED, "job", "id")
            queues = _named(naming, EventKind.JOB_QUEUE_CHANGED, "queue", "vehicle_id")
            return Envelope(
                site=site,
                gateway=self._gateway_id,
                as_of=connection.execute(_LAST_SEQ).fetchone()[0],
                events=tuple(events),
                plans=_rows(connection, PLANS, "id", plans),
                runs=_rows(connection, RUNS, "id", {event.run_id for event in events if event.run_id}),
                jobs=_rows(connection, JOBS, "id", jobs),
                queues=_rows(connection, JOB_QUEUES, "vehicle_id", queues),
            )

        return await self._database.read_at_once(read)


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


_NAMES_DOCUMENTS = (EventKind.PLAN_CREATED, EventKind.JOB_CHANGED, EventKind.JOB_QUEUE_CHANGED)


def _named(events: Sequence[tuple[str, Any]], kind: EventKind, *path: str) -> set[str]:
    found = set()
    for of, data in events:
        if of == kind:
            for step in path:
                data = data[step]
            found.add(str(data))
    return found
