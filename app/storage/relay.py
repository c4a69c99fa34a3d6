"""The journal as it is sent to a cluster: rows of events and documents, not parsed; implements RelayLog."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any

import sqlalchemy as sa

from app.domain.cluster.envelope import Envelope, RelayedEvent, Row
from app.domain.events import EventKind
from app.storage.database import Database
from app.storage.events import LAST_SEQ
from app.storage.schema import EVENTS, JOB_QUEUES, JOBS, PLANS, RUNS


class SqliteRelayLog:
    """RelayLog on one SQLite file."""

    def __init__(self, database: Database, gateway_id: str) -> None:
        self._database = database
        self._gateway_id = gateway_id

    async def envelope(self, site: str, *, after: int, limit: int) -> Envelope:
        as_of = int((await self._database.read(LAST_SEQ))[0]["last_seq"])
        page = sa.select(EVENTS).where(EVENTS.c.seq > after).order_by(EVENTS.c.seq).limit(limit)
        events = [RelayedEvent.model_validate(dict(row)) for row in await self._database.read(page)]
        naming = [(event.kind, json.loads(event.data)) for event in events if event.kind in _NAMES_DOCUMENTS]
        return Envelope(
            site=site,
            gateway=self._gateway_id,
            as_of=as_of,
            events=tuple(events),
            plans=await self._rows(PLANS, PLANS.c.id, _named(naming, EventKind.PLAN_CREATED, "plan_id")),
            runs=await self._rows(RUNS, RUNS.c.id, {event.run_id for event in events if event.run_id}),
            jobs=await self._rows(JOBS, JOBS.c.id, _named(naming, EventKind.JOB_CHANGED, "job", "id")),
            queues=await self._rows(
                JOB_QUEUES, JOB_QUEUES.c.vehicle_id, _named(naming, EventKind.JOB_QUEUE_CHANGED, "queue", "vehicle_id")
            ),
        )

    async def _rows(self, table: sa.Table, key: sa.Column[Any], ids: Iterable[str]) -> tuple[Row, ...]:
        wanted = sorted(ids)
        if not wanted:
            return ()
        rows = await self._database.read(sa.select(table).where(key.in_(wanted)))
        return tuple([{name: value for name, value in row.items() if name != "position"} for row in rows])


_NAMES_DOCUMENTS = (EventKind.PLAN_CREATED, EventKind.JOB_CHANGED, EventKind.JOB_QUEUE_CHANGED)


def _named(events: Sequence[tuple[str, Any]], kind: EventKind, *path: str) -> set[str]:
    found = set()
    for of, data in events:
        if of == kind:
            for step in path:
                data = data[step]
            found.add(str(data))
    return found
