"""Prove that a cluster's store is as it was written: the chain of every gateway, and what its events tell of."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.events.event import JournalHead
from app.storage.chains import Chains, Row
from app.storage.journal_index import JournalIndex
from app.storage.postgres.database import PostgresDatabase
from app.storage.postgres.events import CLUSTER_EVENTS, GATEWAYS, STREAM
from app.storage.schema import PRUNED_KIND
from app.storage.verify import PROGRESS_EVENTS, Progress, Verification

LOOK_AGAIN_S: Final = 2.0
"""So long a document may be newer than the events: a relay sends it as it is now, with events of a moment ago."""
_EVENTS: Final = sa.select(CLUSTER_EVENTS).order_by(CLUSTER_EVENTS.c.position)
_PRUNED: Final = sa.select(CLUSTER_EVENTS).where(PRUNED_KIND, CLUSTER_EVENTS.c.seq > 0)
_FILES: Final = sa.text("SELECT sha256, encode(sha256(content), 'hex') = sha256 AS is_intact FROM attachments")


async def verify_cluster(
    url: str, anchors: Sequence[JournalHead] = (), progress: Progress = lambda checked, total: None
) -> Verification:
    """Check all that API nodes have stored, also while they run. It is only read.

    `anchors` are those of verify_journal, of any gateway. Files that were attached at a gateway are checked there.

    Raises:
        StorageError: PostgreSQL cannot be reached, or has no tables of a cluster.
    """
    database = PostgresDatabase(url)
    try:
        found = await _verified(database, anchors, progress)
        if found.alterations:
            await asyncio.sleep(LOOK_AGAIN_S)
            again = await _verified(database, anchors, progress)
            found = replace(again, alterations=[one for one in again.alterations if one in found.alterations])
        return found
    finally:
        await database.close()


async def _verified(database: PostgresDatabase, anchors: Sequence[JournalHead], progress: Progress) -> Verification:
    async with database.session() as connection:
        # one snapshot, whatever is written meanwhile
        await connection.execution_options(isolation_level="REPEATABLE READ", postgresql_readonly=True)
        (stream,) = await _rows(connection, sa.select(STREAM))
        chains = _Stream(stream["id"], anchors, await _rows(connection, _PRUNED))
        async with connection.stream(_EVENTS) as events:
            async for event in events.mappings():
                if chains.position % PROGRESS_EVENTS == 0:
                    progress(chains.position, stream["position"])
                chains.take(event)
        found = chains.alterations
        if chains.begin > chains.own.pruned_up_to + 1:
            found.append(f"position {chains.begin}: it does not follow position 0")
        if chains.position < stream["position"]:
            found.append(f"events existed up to position {stream['position']} and are missing")
        for gateway in await _rows(connection, sa.select(GATEWAYS)):
            newest = JournalHead(seq=gateway["seq"], hash=gateway["hash"])
            if chains.chains.heads.get(gateway["id"]) != newest and not chains.index.was_pruned(gateway["id"], newest):
                found.append(f"{gateway['id']}: event {gateway['seq']} existed and is missing")
        gaps = chains.chains.gaps
        found += [f"{gap.gateway}: {text}" for gap in gaps for text in chains.index.unexplained(gap, is_whole=False)]
        lost = dict(chains.index.unknown(sorted(chains.missing, key=lambda anchor: anchor.seq), chains.chains))
        found += [f"{text}: no gateway has its hash" for text in lost.values() if text]
        unchecked = [anchor for anchor, text in lost.items() if not text]
        plans, runs, jobs = [
            await _rows(connection, sa.text(f"SELECT * FROM {table} ORDER BY position"))
            for table in ("plans", "runs", "jobs")
        ]
        index = chains.index
        found += [*index.altered_plans(plans), *index.altered_runs(runs), *index.altered_jobs(jobs)]
        files = {row["sha256"]: row["is_intact"] for row in await _rows(connection, _FILES)}
        found += chains.own.altered_attachments(lambda sha256: files.get(sha256, False))
    heads, own = dict(chains.chains.heads), chains.own
    return Verification(
        stream["id"],
        heads,
        chains.chains.events,
        len(plans),
        len(runs),
        own.attachments,
        found,
        unchecked,
        index.unproven,
    )


class _Stream:
    """The chains of all gateways, filled event by event in the order of their positions.

    `pruned` are the events of retention. `own` has what API nodes recorded: the files of these events are in the same
    store. `begin` is the first position, and `position` the last one. `missing` are the anchors that no event had yet.
    """

    def __init__(self, stream_id: str, anchors: Sequence[JournalHead], pruned: Sequence[Row]) -> None:
        self.index, self.own = JournalIndex(), JournalIndex()
        self.chains = Chains()
        self.alterations: list[str] = []
        self.begin = self.position = 0
        self.missing = set(anchors)
        self._stream_id = stream_id
        self._deleted = JournalIndex()
        for event in pruned:
            self._deleted.take(*_stored(event))

    def take(self, event: Row) -> None:
        gateway, seq = event["gateway"], event["seq"]
        if event["position"] < 1:
            self.alterations.append(f"position {event['position']}: no stream has such a number")
        elif self.begin == 0:
            self.begin = event["position"]
        elif event["position"] != self.position + 1:
            self.alterations.append(f"position {event['position']}: it does not follow position {self.position}")
        is_first = gateway not in self.chains.heads
        self.alterations += [f"{gateway}: {one}" for one in self.chains.take(gateway, event)]
        self.position = event["position"]
        self.missing.discard(JournalHead(seq=seq, hash=event["hash"]))
        if seq < 1:
            return
        if is_first and self._deleted.is_left_over(gateway, event):
            self.index.set_aside(event)
            return
        stored = _stored(event)
        if not self.index.take(*stored):
            self.alterations.append(f"{gateway}: event {seq}: its data cannot be read")
        if gateway == self._stream_id:
            self.own.take(*stored)


def _stored(event: Row) -> tuple[Any, Any, Any, Any]:
    return event["kind"], event["version"], event["run_id"], event["data"]


async def _rows(connection: AsyncConnection, query: sa.Executable) -> Sequence[sa.RowMapping]:
    rows: Any = (await connection.execute(query)).mappings().all()
    return list(rows)
