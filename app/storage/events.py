"""The journal's events on disk; implements EventStore."""

from __future__ import annotations

import asyncio
import json
import sqlite3
import zlib
from collections.abc import Sequence
from functools import cache
from typing import Any, Final

import pydantic_core
import sqlalchemy as sa

from app.domain.errors import InvalidInputError, StorageError
from app.domain.events import Event, NewEvent
from app.domain.events.event import JournalHead, event_hash
from app.domain.events.service import JournalPruned
from app.domain.ports.stores import MOST_BYTES, MOST_RUNS, JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run
from app.storage.access import AnswerClock, insert_answers
from app.storage.database import Database, to_json, unreadable
from app.storage.dispatch import INSERT_PLAN, plan_row, upsert_jobs, upsert_runs
from app.storage.relay import RecentCommits
from app.storage.schema import ACCEPTED_KIND, EVENTS, FLIGHT_INPUTS, OFFBOARD_KINDS, PRUNED_KIND

LAST_SEQ = sa.select(sa.func.coalesce(sa.func.max(EVENTS.c.seq), 0).label("last_seq"))
_HEAD: Final = "SELECT seq, hash FROM events ORDER BY seq DESC LIMIT 1"
_COLUMNS: Final = tuple(EVENTS.c.keys())
ROWS_AT_ONCE: Final = 64
"""Events in one statement."""

_LAST_OFFBOARD = (
    sa.select(EVENTS)
    .where(
        EVENTS.c.seq.in_(
            sa.select(sa.func.max(EVENTS.c.seq)).where(OFFBOARD_KINDS).group_by(EVENTS.c.kind, EVENTS.c.vehicle_id)
        )
    )
    .order_by(EVENTS.c.seq)
)


class SqliteEventStore:
    """EventStore on one SQLite file."""

    def __init__(
        self, database: Database, gateway_id: str, recent: RecentCommits, answer_clock: AnswerClock | None = None
    ) -> None:
        self._database = database
        self._gateway_id = gateway_id
        self._recent = recent
        self._answer_clock = answer_clock or AnswerClock()

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """See EventStore. If it raises, nothing of the call is stored.

        Raises:
            StorageError: the file cannot be written, or a plan's id is taken.
            InvalidInputError: an event's data is not JSON.
        """
        if not events and not runs and not plans and not jobs:
            return ()
        rows = [event_row(event) for event in events]
        plan_rows = [plan_row(plan) for plan in plans]

        def insert(connection: sqlite3.Connection) -> tuple[Sequence[dict[str, Any]], tuple[Event, ...]]:
            # read anew each time: whatever became of an earlier commit, the next number and link are the right ones
            links = chained(self._gateway_id, _head(connection), rows)
            _insert_events(connection, links)
            connection.executemany(INSERT_PLAN, plan_rows)
            upsert_runs(connection, runs)
            upsert_jobs(connection, jobs)
            insert_answers(connection, answers, self._answer_clock)
            return links, tuple(
                [
                    event.numbered(row["seq"], self._gateway_id, row["hash"])
                    for event, row in zip(events, links, strict=True)
                ]
            )

        links, stored = await self._database.append(insert)
        self._recent.add(links, runs, has_others=bool(plans or jobs))
        return stored

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        query = sa.select(EVENTS).where(EVENTS.c.seq > after).order_by(EVENTS.c.seq).limit(limit)
        if run_id is not None:
            query = query.where(EVENTS.c.run_id == run_id)
        return tuple([self._stored(row) for row in await self._database.read(query)])

    async def newest_accepted(self, *, before: int | None, limit: int) -> Sequence[Event]:
        query = sa.select(EVENTS).where(ACCEPTED_KIND, EVENTS.c.seq > 0).order_by(EVENTS.c.seq.desc()).limit(limit)
        if before is not None:
            query = query.where(EVENTS.c.seq < before)
        return tuple([self._stored(row) for row in await self._database.read(query)])

    async def last_seq(self) -> int:
        return int((await self._database.read(LAST_SEQ))[0]["last_seq"])

    async def last_offboard(self) -> Sequence[Event]:
        return tuple([self._stored(row) for row in await self._database.read(_LAST_OFFBOARD)])

    async def last_pruned(self) -> JournalPruned | None:
        query = sa.select(EVENTS).where(PRUNED_KIND, EVENTS.c.seq > 0).order_by(EVENTS.c.seq.desc()).limit(1)
        for row in await self._database.read(query):
            if isinstance(pruned := self._stored(row).data, JournalPruned):
                return pruned
        return None

    def _stored(self, row: sa.RowMapping) -> Event:
        try:
            return Event.model_validate({**row, "data": json.loads(row["data"]), "gateway": self._gateway_id})
        except ValueError as error:  # pydantic's ValidationError and JSONDecodeError are both
            raise unreadable(f"event {row['seq']}") from error


def chained(gateway_id: str, head: JournalHead, rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows with the numbers and hashes that follow `head`."""
    links, previous = [], head.hash
    for seq, row in enumerate(rows, head.seq + 1):
        previous = event_hash(previous, gateway=gateway_id, seq=seq, **row)
        links.append({**row, "seq": seq, "hash": previous})
    return links


def _head(connection: sqlite3.Connection) -> JournalHead:
    row = connection.execute(_HEAD).fetchone()
    return JournalHead() if row is None else JournalHead(seq=row[0], hash=row[1])


def _insert_events(connection: sqlite3.Connection, rows: Sequence[dict[str, Any]]) -> None:
    # many rows in a statement: sqlite3 asks for the interpreter's lock once for each statement that it steps
    for first in range(0, len(rows), ROWS_AT_ONCE):
        part = rows[first : first + ROWS_AT_ONCE]
        connection.execute(_insertion(len(part)), [row[column] for row in part for column in _COLUMNS])


@cache
def _insertion(rows: int) -> str:
    values = f"({', '.join('?' * len(_COLUMNS))})"
    return f"INSERT INTO events ({', '.join(_COLUMNS)}) VALUES {', '.join([values] * rows)}"


def event_row(event: NewEvent) -> dict[str, Any]:
    """The columns of an event without a number. Raises InvalidInputError if its data is not JSON."""
    payload, time, vehicle_id, run_id = event
    kind = payload.kind.value
    return {
        "kind": kind,
        "version": payload.version,
        "time": time,
        "vehicle_id": vehicle_id,
        "run_id": run_id,
        "data": _data_json(kind, payload.model_dump(mode="json")),
    }


def _data_json(kind: str, data: dict[str, Any]) -> str:
    what = f"the data of {kind}"
    try:
        text = pydantic_core.to_json(data, inf_nan_mode="constants").decode()  # takes a fourth of json's time
    except ValueError as error:
        raise InvalidInputError(f"{what} cannot be stored: {error}") from error
    return to_json(what, data) if "NaN" in text or "Infinity" in text else text


class SqliteFlightLog:
    """FlightLog on one SQLite file. Parts are packed, and old runs make room for new ones."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def append(self, run_id: str, text: str) -> None:
        part = await asyncio.to_thread(zlib.compress, text.encode())

        def store(connection: sa.Connection) -> None:
            of_run = FLIGHT_INPUTS.c.run_id == run_id
            size = sa.select(sa.func.coalesce(sa.func.sum(sa.func.length(FLIGHT_INPUTS.c.part)), 0)).where(of_run)
            kept = connection.execute(size).scalar_one()
            if kept + len(part) > MOST_BYTES:
                return
            connection.execute(FLIGHT_INPUTS.insert(), {"run_id": run_id, "part": part})
            if kept == 0:
                connection.execute(FLIGHT_INPUTS.delete().where(FLIGHT_INPUTS.c.position.in_(_old())))

        await self._database.write(store)

    async def read(self, run_id: str) -> str:
        of_run = sa.select(FLIGHT_INPUTS.c.part).where(FLIGHT_INPUTS.c.run_id == run_id)
        rows = await self._database.read(of_run.order_by(FLIGHT_INPUTS.c.position))
        try:
            return "".join(zlib.decompress(row["part"]).decode() for row in rows)
        except (zlib.error, ValueError) as error:
            raise StorageError(f"the inputs of run {run_id} cannot be read: {error}") from error


def _old() -> sa.Select[tuple[int]]:
    """The positions of the parts beyond those of the newest runs, from the index alone."""
    newest = sa.func.max(FLIGHT_INPUTS.c.position).desc()
    kept = sa.select(FLIGHT_INPUTS.c.run_id).group_by(FLIGHT_INPUTS.c.run_id).order_by(newest).limit(MOST_RUNS)
    return sa.select(FLIGHT_INPUTS.c.position).where(FLIGHT_INPUTS.c.run_id.not_in(kept))
