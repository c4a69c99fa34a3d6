"""Events per second of Journal.record; the floor is the same rows in the same commits through sqlite3 alone.

Both write to one disk, in turns, with the same durability (WAL, synchronous=FULL). The floor makes no rows: they lie
ready, hashes too, and no trigger looks at them. What Waydrop costs on top of SQLite: making events and their chain of
hashes, threads, fan-out to one subscriber, and a task switch for each caller.
"""

from __future__ import annotations

import asyncio
import os
import sqlite3
import tempfile
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, closing
from pathlib import Path
from typing import Final

from app.domain.events import Event, NewEvent
from app.domain.events.run import RunItem
from app.domain.ports.stores import EventStore, JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run
from app.services.clock import SystemClock
from app.services.journal import EventSubscription, Journal
from app.storage import open_storage
from bench.row import Goal, Pair, Round, Row, Scale

TOLD = RunItem(item_id=f"clinic {'x' * 100}", seq=7, phase="reached")
SHORT_S, LONG_S = 0.4, 1.0
"""Of one round."""


class CountingStore:
    """Passes on to a store and keeps the size of each commit."""

    def __init__(self, store: EventStore) -> None:
        self._store = store
        self.commits: list[int] = []

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """See EventStore."""
        self.commits.append(len(events))
        return await self._store.append(events, runs, plans, jobs, answers)

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """See EventStore."""
        return await self._store.read(after=after, limit=limit, run_id=run_id)

    async def last_pruned(self) -> None:
        """See EventStore."""

    async def last_seq(self) -> int:
        """See EventStore."""
        return await self._store.last_seq()

    async def newest_accepted(self, *, before: int | None, limit: int) -> Sequence[Event]:
        """See EventStore."""
        return ()

    async def last_offboard(self) -> Sequence[Event]:
        """See EventStore."""
        return await self._store.last_offboard()


async def record_for(journal: Journal, callers: int, seconds: float) -> float:
    """Events per second of `callers` tasks that record one event after another."""
    done = 0
    begun_s = time.perf_counter()

    async def record() -> None:
        nonlocal done
        while time.perf_counter() - begun_s < seconds:
            await journal.record(journal.new_event(TOLD, vehicle_id="v1", run_id="run-1"))
            done += 1

    await asyncio.gather(*(record() for _ in range(callers)))
    return done / (time.perf_counter() - begun_s)


def floor(path: Path, commits: Sequence[int]) -> float:
    """Events per second of sqlite3 with the same rows in the same commits."""
    data, link = TOLD.model_dump_json(), "0" * 64
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute(
            "CREATE TABLE IF NOT EXISTS events "
            "(seq INTEGER PRIMARY KEY, kind, version, time, vehicle_id, run_id, data, hash)"
        )
        connection.execute("CREATE INDEX IF NOT EXISTS of_run ON events (run_id, seq)")
        seq = connection.execute("SELECT coalesce(max(seq), 0) FROM events").fetchone()[0]
        rows = [(seq + n, "run.item", 1, 1.0, "v1", "run-1", data, link) for n in range(1, sum(commits) + 1)]
        begun_s = time.perf_counter()
        first = 0
        for size in commits:
            connection.execute("BEGIN IMMEDIATE")
            connection.executemany("INSERT INTO events VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows[first : first + size])
            connection.execute("COMMIT")
            first += size
        return sum(commits) / (time.perf_counter() - begun_s)


async def drain(subscription: EventSubscription) -> None:
    """A subscriber that keeps up."""
    while True:
        await subscription.get()


@asynccontextmanager
async def prepared(callers: int, scale: Scale) -> AsyncIterator[Round]:
    """A journal and the floor's file in one folder."""
    seconds = LONG_S if scale.long else SHORT_S
    with tempfile.TemporaryDirectory(dir=os.environ.get("BENCH_DISK")) as folder:
        async with open_storage(Path(folder) / "journal.db") as storage:

            async def measure() -> Pair:
                store = CountingStore(storage.events)
                journal = Journal(store, SystemClock())
                await journal.start()
                reader = asyncio.create_task(drain(journal.subscribe(4096)))
                per_s = await record_for(journal, callers, seconds)
                reader.cancel()
                await journal.close()
                return Pair(per_s, await asyncio.to_thread(floor, Path(folder) / "floor.db", store.commits))

            await measure()
            yield measure


def row(callers: int, goal: float, limited_by: str) -> Row:
    """So many tasks record at the same time."""
    return Row(
        name=f"journal-{callers}",
        title=f"events recorded by {callers} {'caller' if callers == 1 else 'callers at once'}",
        floor="the same rows in the same commits by sqlite3 alone",
        unit="events/s",
        goal=Goal(goal, "at least"),
        prepare=lambda scale: prepared(callers, scale),
        limited_by=limited_by,
        rounds=9,
    )


ROWS: Final = (
    row(1, 0.5, "the disk, and a change of thread for each commit"),
    row(16, 0.4, "making the events, a task switch for each caller"),
    row(256, 0.25, "making the events, a task switch for each caller"),
)
