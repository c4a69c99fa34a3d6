"""Events of all gateways in one order, and the cluster's own; implements EventStore and ProjectionStore."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager, nullcontext
from typing import Any, Final

import asyncpg
import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.cluster.envelope import Envelope, RelayedEvent
from app.domain.events import Event, NewEvent
from app.domain.events.event import JournalHead
from app.domain.events.service import JournalPruned
from app.domain.ports.stores import JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run
from app.storage.access import answer_row
from app.storage.database import unreadable
from app.storage.dispatch import plan_row
from app.storage.events import chained, event_row
from app.storage.postgres.database import PostgresDatabase, arrays_of, driver_of, postgres_errors, unnested
from app.storage.postgres.documents import RUN_TYPES, newest_rows, put_runs, store_others, store_own
from app.storage.schema import ACCEPTED_KIND, OFFBOARD_KINDS, PLANS, PRUNED_KIND

CHANNEL: Final = "waydrop_events"
LEADER_LOCK: Final = 0x5761790001
ASKED_AGAIN_S: Final = 0.5
"""How often a process that wants to write looks whether the one that does has ended."""
ANSWERED_S: Final = 3.0
"""A connection that does not answer for so long is lost: no machine may have said so. PostgreSQL ends it after 5 s."""
LOOK_S: Final = 5.0
"""How often a connection that waits for NOTIFY looks whether it is still one."""

STREAM: Final = sa.table("stream", sa.column("id", sa.Text), sa.column("position", sa.BigInteger))
GATEWAYS: Final = sa.table("gateways", *(sa.column(name) for name in ("id", "site", "seq", "hash")))
_COLUMNS: Final = ("position", "gateway", "seq", "kind", "version", "time", "vehicle_id", "run_id", "data", "hash")
CLUSTER_EVENTS: Final = sa.table("events", *(sa.column(name) for name in _COLUMNS))
_POSITION: Final = CLUSTER_EVENTS.c.position
_LAST_POSITION: Final = sa.select(STREAM.c.position)
_CLAIM: Final = sa.text(
    "WITH claimed AS (UPDATE stream SET position = position + :count RETURNING position) "
    f"SELECT position, CASE WHEN :count > 0 THEN pg_notify('{CHANNEL}', position::text) END FROM claimed"
)
_EVENT_TYPES: Final = {
    "gateway": "text",
    "seq": "bigint",
    "kind": "text",
    "version": "integer",
    "time": "double precision",
    "vehicle_id": "text",
    "run_id": "text",
    "data": "text",
    "hash": "text",
}
_HEAD_TYPES: Final = {"id": "text", "site": "text", "seq": "bigint", "hash": "text"}
_APPEND: Final = f"""
WITH claimed AS (UPDATE stream SET position = position + $1 RETURNING position),
stored AS (
    INSERT INTO events (position, {", ".join(_EVENT_TYPES)})
    SELECT claimed.position - $1 + n, {", ".join(f"new.{name}" for name in _EVENT_TYPES)}
    FROM claimed, {unnested(2, _EVENT_TYPES)}),
heads AS (
    INSERT INTO gateways (id, site, seq, hash)
    SELECT new.id, new.site, new.seq, new.hash FROM claimed, {unnested(11, _HEAD_TYPES)}
    ON CONFLICT (id) DO UPDATE SET site = excluded.site, seq = excluded.seq, hash = excluded.hash),
runs_of_them AS ({put_runs(f"claimed, {unnested(15, RUN_TYPES)}")})
SELECT pg_notify('{CHANNEL}', position::text) FROM claimed
"""
"""Events of gateways, their newest ones, their runs and NOTIFY, in one round trip. Each part reads `claimed`, so that
nothing is locked before the row that gives positions, here as elsewhere.
"""
_PAGE: Final = f"SELECT {', '.join(_COLUMNS)} FROM events WHERE position > $1 ORDER BY position LIMIT $2"
_SET_HEAD: Final = sa.text(
    "INSERT INTO gateways (id, site, seq, hash) VALUES (:id, :site, :seq, :hash) "
    "ON CONFLICT (id) DO UPDATE SET site = excluded.site, seq = excluded.seq, hash = excluded.hash"
)
PUT_ANSWER: Final = sa.text(
    "INSERT INTO answers (key, request_hash, status, headers, body, stored_at) "
    "VALUES (:key, :request_hash, :status, :headers, :body, extract(epoch FROM now())) ON CONFLICT (key) DO NOTHING"
)
"""The clock of the server, as that of a node may jump."""

_LAST_OFFBOARD: Final = (
    sa.select(CLUSTER_EVENTS)
    .where(
        _POSITION.in_(
            sa.select(sa.func.max(_POSITION))
            .where(OFFBOARD_KINDS)
            .group_by(CLUSTER_EVENTS.c.kind, CLUSTER_EVENTS.c.vehicle_id)
        )
    )
    .order_by(_POSITION)
)


class ClusterEventStore:
    """EventStore by positions. What is appended here is the cluster's own: its chain has the stream's id."""

    def __init__(self, database: PostgresDatabase, stream_id: str) -> None:
        self._database = database
        self._stream_id = stream_id

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
            StorageError: it cannot be stored, or a plan's id is taken.
            InvalidInputError: an event's data is not JSON.
        """
        if not events and not runs and not plans and not jobs:
            return ()
        rows = [event_row(event) for event in events]
        plan_rows = [plan_row(plan) for plan in plans]

        async def insert(connection: AsyncConnection) -> tuple[Event, ...]:
            first = await _claim_positions(connection, len(rows))
            head = await _head_of(connection, self._stream_id)
            links = chained(self._stream_id, head, rows)
            await _insert(connection, self._stream_id, first, links)
            if plan_rows:
                await connection.execute(sa.insert(PLANS), plan_rows)
            as_of = head.seq + len(links)
            await store_own(connection, runs, jobs, as_of)
            if answers:
                await connection.execute(PUT_ANSWER, [answer_row(one) for one in answers])
            if links:
                last = {"id": self._stream_id, "site": "", "seq": as_of, "hash": links[-1]["hash"]}
                await connection.execute(_SET_HEAD, last)
            return tuple(
                [
                    event.numbered(row["seq"], self._stream_id, row["hash"], position)
                    for position, (event, row) in enumerate(zip(events, links, strict=True), first)
                ]
            )

        return await self._database.transact(insert)

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """See EventStore; by position."""
        query = sa.select(CLUSTER_EVENTS).where(after < _POSITION).order_by(_POSITION).limit(limit)
        if run_id is not None:
            query = query.where(CLUSTER_EVENTS.c.run_id == run_id)
        return tuple([_stored(row) for row in await self._database.read(query)])

    async def newest_accepted(self, *, before: int | None, limit: int) -> Sequence[Event]:
        """See EventStore; by position."""
        query = sa.select(CLUSTER_EVENTS).where(ACCEPTED_KIND).order_by(_POSITION.desc()).limit(limit)
        if before is not None:
            query = query.where(before > _POSITION)
        return tuple([_stored(row) for row in await self._database.read(query)])

    async def last_seq(self) -> int:
        """See EventStore; the newest position."""
        return int((await self._database.read(_LAST_POSITION))[0]["position"])

    async def seqs(self) -> Mapping[str, int]:
        """See ClusterEvents."""
        rows = await self._database.read(sa.select(GATEWAYS.c.id, GATEWAYS.c.seq))
        return {row["id"]: row["seq"] for row in rows}

    async def last_offboard(self) -> Sequence[Event]:
        return tuple([_stored(row) for row in await self._database.read(_LAST_OFFBOARD)])

    async def last_pruned(self) -> JournalPruned | None:
        """See EventStore; of the cluster's own chain."""
        own = sa.select(CLUSTER_EVENTS).where(PRUNED_KIND, CLUSTER_EVENTS.c.gateway == self._stream_id)
        for row in await self._database.read(own.order_by(_POSITION.desc()).limit(1)):
            if isinstance(pruned := _stored(row).data, JournalPruned):
                return pruned
        return None

    async def pages(self, after: int, limit: int) -> AsyncGenerator[Sequence[Event], None]:
        changed, told = asyncio.Event(), 0

        def tell(_connection: object, _process: int, _channel: str, position: str) -> None:
            nonlocal told
            told = max(told, int(position))
            changed.set()

        async with self._database.session() as connection:
            driver = await driver_of(connection)
            await driver.add_listener(CHANNEL, tell)
            driver.add_termination_listener(lambda _: changed.set())
            while True:
                page = [_stored(row) for row in await driver.fetch(_PAGE, after, limit)]
                after = page[-1].position if page else after
                yield page
                while len(page) < limit and told <= after and not driver.is_closed():
                    changed.clear()
                    try:
                        async with asyncio.timeout(LOOK_S):
                            await changed.wait()
                    except TimeoutError:
                        await driver.execute("SELECT", timeout=ANSWERED_S)


class PostgresProjectionStore:
    """ProjectionStore. The right to write is a lock of a connection that does all the writing: it ends with it."""

    def __init__(self, database: PostgresDatabase) -> None:
        self._database = database

    @asynccontextmanager
    async def leading(self) -> AsyncIterator[PostgresProjectionWriter]:
        async with self._database.session() as connection:
            while not (await connection.execute(sa.select(sa.func.pg_try_advisory_lock(LEADER_LOCK)))).scalar_one():
                await connection.commit()
                await asyncio.sleep(ASKED_AGAIN_S)
            await connection.commit()
            yield PostgresProjectionWriter(connection, await driver_of(connection))


class PostgresProjectionWriter:
    """ProjectionWriter on the connection that has the lock.

    It writes by the driver's own connection: SQLAlchemy would connect anew, without the lock, once it knows of a loss.
    """

    def __init__(self, connection: AsyncConnection, driver: asyncpg.Connection[Any]) -> None:
        self._connection = connection
        self._driver = driver
        self._turn = asyncio.Lock()  # a connection does one thing at a time

    async def heads(self) -> Mapping[str, JournalHead]:
        with postgres_errors():
            async with self._turn, self._connection.begin():
                rows = (await self._connection.execute(sa.select(GATEWAYS))).mappings().all()
        return {row["id"]: JournalHead(seq=row["seq"], hash=row["hash"]) for row in rows}

    async def append(self, batch: Sequence[tuple[Envelope, Sequence[RelayedEvent]]]) -> None:
        envelopes = [envelope for envelope, _ in batch]
        rows = [{**vars(event), "gateway": envelope.gateway} for envelope, events in batch for event in events]
        heads = {
            envelope.gateway: {"id": envelope.gateway, "site": envelope.site, "seq": last.seq, "hash": last.hash}
            for envelope, events in batch
            for last in events[-1:]
        }
        given = (
            *arrays_of(rows, _EVENT_TYPES),
            *arrays_of(list(heads.values()), _HEAD_TYPES),
            *arrays_of(newest_rows("id", envelopes, [one.runs for one in envelopes]), RUN_TYPES),
        )
        others = [one for one in envelopes if one.plans or one.jobs or one.queues]
        with postgres_errors():
            transaction = self._driver.transaction() if others else nullcontext()  # one statement is a transaction
            async with self._turn, transaction:
                await self._driver.execute(_APPEND, len(rows), *given)
                await store_others(self._driver, others)

    async def check(self) -> None:
        """See ProjectionWriter. The lock ends with the connection."""
        with postgres_errors():
            async with self._turn:
                await self._driver.execute("SELECT", timeout=ANSWERED_S)


async def _claim_positions(connection: AsyncConnection, count: int) -> int:
    """The first of `count` positions. Until the commit nobody else gets any, so that readers never see a gap."""
    last = int((await connection.execute(_CLAIM, {"count": count})).scalar_one())
    return last - count + 1


async def _insert(connection: AsyncConnection, gateway: str, first: int, rows: Sequence[Mapping[str, Any]]) -> None:
    if not rows:
        return
    records = [[position, gateway, *(row[name] for name in _COLUMNS[2:])] for position, row in enumerate(rows, first)]
    driver = await driver_of(connection)
    await driver.copy_records_to_table("events", records=records, columns=_COLUMNS)


async def _head_of(connection: AsyncConnection, gateway: str) -> JournalHead:
    query = sa.select(GATEWAYS.c.seq, GATEWAYS.c.hash).where(GATEWAYS.c.id == gateway)
    row = (await connection.execute(query)).mappings().one_or_none()
    return JournalHead() if row is None else JournalHead(**row)


def _stored(row: sa.RowMapping | asyncpg.Record) -> Event:
    try:
        return Event.model_validate({**row, "data": json.loads(row["data"])})
    except ValueError as error:  # pydantic's ValidationError and JSONDecodeError are both
        raise unreadable(f"event {row['position']}") from error
