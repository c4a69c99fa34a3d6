"""Events per second of Journal.record against a floor: the same rows in the same commits through sqlite3 alone.

Usage: python -m bench.journal [--seconds 2] [--folder DIR]

Both write to one disk, in turns, with the same durability (WAL, synchronous=FULL). The ratio is what Waydrop costs
on top of SQLite: checks, numbering, SQLAlchemy, threads, fan-out to one subscriber, and a task switch per caller.
"""

from __future__ import annotations

import argparse
import asyncio
import sqlite3
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from app.domain.events import Event, NewEvent
from app.domain.events.run import RunItem
from app.domain.ports.stores import EventStore, JobRecord, StoredPlan
from app.domain.run.run import Run
from app.services.clock import SystemClock
from app.services.journal import EventSubscription, Journal
from app.storage import open_storage

TOLD = RunItem(item_id=f"clinic {'x' * 100}", seq=7, phase="reached")
ROUNDS = 5
CALLERS = (1, 16, 256)


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
    ) -> Sequence[Event]:
        """See EventStore."""
        self.commits.append(len(events))
        return await self._store.append(events, runs, plans, jobs)

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """See EventStore."""
        return await self._store.read(after=after, limit=limit, run_id=run_id)

    async def last_seq(self) -> int:
        """See EventStore."""
        return await self._store.last_seq()

    async def last_offboard(self) -> Sequence[Event]:
        """See EventStore."""
        return await self._store.last_offboard()


@dataclass(frozen=True, slots=True)
class Round:
    """One turn of both: events per second, each caller's waiting times, and the mean size of a commit."""

    journal_per_s: float
    floor_per_s: float
    latencies_s: list[float]
    events_per_commit: float


async def record_for(journal: Journal, callers: int, seconds: float) -> tuple[float, list[float]]:
    """Events per second of `callers` tasks that record one event after another, and how long each took."""
    latencies: list[float] = []
    start = time.perf_counter()

    async def record() -> None:
        while (begun := time.perf_counter()) - start < seconds:
            await journal.record(journal.new_event(TOLD, vehicle_id="v1", run_id="run-1"))
            latencies.append(time.perf_counter() - begun)

    await asyncio.gather(*(record() for _ in range(callers)))
    return len(latencies) / (time.perf_counter() - start), latencies


def floor(path: Path, commits: Sequence[int]) -> float:
    """Events per second of sqlite3 with the same rows in the same commits; the triggers are left out too."""
    data = TOLD.model_dump_json()
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute(
            "CREATE TABLE IF NOT EXISTS events (seq INTEGER PRIMARY KEY, kind, time, vehicle_id, run_id, data)"
        )
        connection.execute("CREATE INDEX IF NOT EXISTS of_run ON events (run_id, seq)")
        seq = connection.execute("SELECT coalesce(max(seq), 0) FROM events").fetchone()[0]
        start = time.perf_counter()
        for size in commits:
            connection.execute("BEGIN IMMEDIATE")
            rows = [(seq + n, "run.item", 1.0, "v1", "run-1", data) for n in range(1, size + 1)]
            connection.executemany("INSERT INTO events VALUES (?, ?, ?, ?, ?, ?)", rows)
            connection.execute("COMMIT")
            seq += size
        return sum(commits) / (time.perf_counter() - start)


async def drain(subscription: EventSubscription) -> None:
    """A subscriber that keeps up."""
    while True:
        await subscription.get()


async def measure(folder: Path, callers: int, seconds: float) -> list[Round]:
    """ROUNDS turns of the journal and of the floor, one after the other."""
    rounds = []
    async with open_storage(folder / f"journal-{callers}.db") as storage:
        for _ in range(ROUNDS):
            store = CountingStore(storage.events)
            journal = Journal(store, SystemClock())
            await journal.start()
            reader = asyncio.create_task(drain(journal.subscribe(4096)))
            per_s, latencies = await record_for(journal, callers, seconds)
            reader.cancel()
            await journal.close()
            floor_per_s = await asyncio.to_thread(floor, folder / f"floor-{callers}.db", store.commits)
            rounds.append(Round(per_s, floor_per_s, latencies, statistics.mean(store.commits)))
    return rounds


def report(callers: int, rounds: Sequence[Round]) -> str:
    """One line for people: medians over the rounds."""
    journal = statistics.median(one.journal_per_s for one in rounds)
    raw = statistics.median(one.floor_per_s for one in rounds)
    ratios = sorted(one.journal_per_s / one.floor_per_s for one in rounds)
    latencies = sorted(latency for one in rounds for latency in one.latencies_s)
    p50, p99 = latencies[len(latencies) // 2], latencies[len(latencies) * 99 // 100]
    size = statistics.median(one.events_per_commit for one in rounds)
    return (
        f"{callers:>7} {journal:>10.0f} {raw:>10.0f} {statistics.median(ratios):>6.2f} "
        f"({ratios[0]:.2f} to {ratios[-1]:.2f}) {size:>12.1f} {p50 * 1e3:>8.2f} {p99 * 1e3:>8.2f}\n"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=1.0, help="length of one turn")
    parser.add_argument("--folder", type=Path, help="where to write; a temporary folder if not given")
    arguments = parser.parse_args()
    sys.stdout.write("callers  journal/s    floor/s  ratio   (min to max) events/commit  p50[ms]  p99[ms]\n")
    with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
        for callers in CALLERS:
            sys.stdout.write(report(callers, asyncio.run(measure(Path(folder), callers, arguments.seconds))))
            sys.stdout.flush()


if __name__ == "__main__":
    main()
