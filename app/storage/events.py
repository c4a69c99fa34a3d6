"""The journal's events on disk; implements EventStore."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.events import Event, NewEvent
from app.domain.run import Run
from app.storage.database import Database
from app.storage.documents import to_json, unreadable
from app.storage.runs import upsert_runs
from app.storage.schema import EVENTS

_LAST_SEQ = sa.select(sa.func.coalesce(sa.func.max(EVENTS.c.seq), 0).label("last_seq"))

# numbered by the statement itself, row by row: whatever became of an earlier commit, the next number is the right one
_INSERT_NEXT = sa.insert(EVENTS).values(
    seq=sa.select(sa.func.coalesce(sa.func.max(EVENTS.c.seq), 0) + 1).scalar_subquery()
)


class SqliteEventStore:
    """EventStore on one SQLite file."""

    def __init__(self, database: Database, gateway_id: str) -> None:
        self._database = database
        self._gateway_id = gateway_id

    async def append(self, events: Sequence[NewEvent], runs: Sequence[Run] = ()) -> Sequence[Event]:
        """See EventStore. If it raises, nothing of the call is stored.

        Raises:
            StorageError: the file cannot be written.
            InvalidInputError: an event's data is not JSON.
        """
        if not events and not runs:
            return ()
        rows = [_row(event) for event in events]

        async def insert(connection: AsyncConnection) -> int:
            if rows:
                await connection.execute(_INSERT_NEXT, rows)
            await upsert_runs(connection, runs)
            return int((await connection.execute(_LAST_SEQ)).scalar_one()) if rows else 0

        last_seq = await self._database.write(insert)
        return tuple([self._numbered(event, seq) for seq, event in enumerate(events, last_seq - len(rows) + 1)])

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """See EventStore."""
        query = sa.select(EVENTS).where(EVENTS.c.seq > after).order_by(EVENTS.c.seq).limit(limit)
        if run_id is not None:
            query = query.where(EVENTS.c.run_id == run_id)
        return tuple([self._stored(row) for row in await self._database.read(query)])

    async def last_seq(self) -> int:
        """See EventStore."""
        return int((await self._database.read(_LAST_SEQ))[0]["last_seq"])

    def _numbered(self, event: NewEvent, seq: int) -> Event:
        return Event(
            kind=event.kind,
            time=event.time,
            vehicle_id=event.vehicle_id,
            run_id=event.run_id,
            data=event.data,
            seq=seq,
            gateway=self._gateway_id,
        )

    def _stored(self, row: sa.RowMapping) -> Event:
        try:
            return Event.model_validate({**row, "data": json.loads(row["data"]), "gateway": self._gateway_id})
        except ValueError as error:  # pydantic's ValidationError and JSONDecodeError are both
            raise unreadable(f"event {row['seq']}") from error


def _row(event: NewEvent) -> dict[str, Any]:
    return {
        "kind": event.kind.value,
        "time": event.time,
        "vehicle_id": event.vehicle_id,
        "run_id": event.run_id,
        "data": to_json(f"the data of {event.kind.value}", event.data),
    }
