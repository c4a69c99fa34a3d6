"""What the journal costs as it grows: to start on it, to read on in it, to list runs, to verify it, to delete half.

Usage: python -m bench.growth [--largest 1000000] [--folder FOLDER]

Makes journals of 1,000, 10,000 ... events with a run for every 50, and prints for each the CPU time of this process,
with that of the kernel for it: other processes do not lengthen it. Exit status 1 if something grew faster than the
journal. 10,000,000 events take about 2 GB, and as much again while half of them are deleted from a copy.
"""

from __future__ import annotations

import argparse
import asyncio
import shutil
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.domain.events import AnyPayload, NewEvent
from app.domain.events.run import RunChanged, RunCreated
from app.domain.plan.document import document_hash
from app.domain.ports.stores import ALL_RUNS, RunFilter
from app.domain.run.run import Run, RunState
from app.services.clock import SystemClock
from app.services.journal import Journal
from app.services.retention import DAY_S, Retention, RetentionPeriods
from app.storage import Storage, open_storage, verify_journal
from bench.table import print_line
from tests.support.events import item
from tests.support.stored_samples import plan, run
from tests.support.verified_journal import DOCUMENT, announced

SMALLEST: Final = 1000
EVENTS_OF_RUN: Final = 50
RUNS_AT_ONCE: Final = 20
PAGE: Final = 500
LIST: Final = 50
SLACK: Final = 1.5
"""How much more than its share a step may take."""
PLAN: Final = replace(plan(), hash=document_hash(DOCUMENT), document=DOCUMENT)
Work = Callable[[], Awaitable[object]]


@dataclass(frozen=True, slots=True)
class Size:
    """What a journal of so many events costs: milliseconds of CPU time by the name of the work, bytes on the disk."""

    events: int
    cpu_ms: dict[str, float]
    bytes_per_event: float


def flown(number: int) -> Iterator[tuple[AnyPayload, Run]]:
    """The events of a run from its beginning to its end, each with the run as it is then."""
    new = run(number).model_copy(update={"plan_hash": PLAN.hash, "drops": ()})
    over = new.model_copy(update={"state": RunState.COMPLETED})
    yield RunCreated(new), new
    yield from ((item(place), new) for place in range(EVENTS_OF_RUN - 2))
    yield RunChanged(over), over


async def fill(storage: Storage, events: int) -> None:
    """Append runs until the journal has `events` events."""
    if await storage.events.last_seq() == 0:
        await storage.events.append([NewEvent.of(announced(PLAN), 1000.0)], plans=[PLAN])
    first, end = (await storage.events.last_seq()) // EVENTS_OF_RUN + 1, events // EVENTS_OF_RUN + 1
    for start in range(first, end, RUNS_AT_ONCE):
        recorded = [pair for number in range(start, min(start + RUNS_AT_ONCE, end)) for pair in flown(number)]
        await storage.events.append(
            [NewEvent.of(payload, time_of(of.id), vehicle_id="v1", run_id=of.id) for payload, of in recorded],
            [of for _, of in recorded],
        )


def time_of(run_id: str) -> float:
    """A run takes a second."""
    return 1000.0 + int(run_id.removeprefix("run-"))


@asynccontextmanager
async def started(path: Path) -> AsyncIterator[tuple[Storage, Journal]]:
    """As the service starts on a journal."""
    async with open_storage(path) as storage:
        journal = Journal(storage.events, SystemClock())
        await journal.start()
        await storage.runs.list_runs(RunFilter(open_only=True), limit=LIST)
        await storage.events.last_offboard()
        try:
            yield storage, journal
        finally:
            await journal.close()


async def cpu_ms(work: Work, *, times: int) -> float:
    """The best of some times."""
    found = []
    for _ in range(times):
        begun_s = time.process_time()
        await work()
        found.append((time.process_time() - begun_s) * 1e3)
    return min(found)


async def measured(path: Path, events: int) -> Size:
    """Grow the journal at `path` to a size, and measure."""

    async def start() -> None:
        async with started(path):
            pass

    async with open_storage(path) as storage:
        await fill(storage, events)
    found = {"start": await cpu_ms(start, times=5)}
    async with started(path) as (storage, journal):
        middle = RunFilter(older_than=f"run-{events // EVENTS_OF_RUN // 2}")
        work: dict[str, Work] = {
            "page": lambda: journal.read(events // 2, PAGE),
            "page of a run": lambda: journal.read(0, PAGE, f"run-{events // EVENTS_OF_RUN // 2}"),
            "newest runs": lambda: storage.runs.list_runs(ALL_RUNS, limit=LIST),
            "older runs": lambda: storage.runs.list_runs(middle, limit=LIST),
        }
        for name, one in work.items():
            found[name] = await cpu_ms(one, times=20)
    found["verify"] = await cpu_ms(lambda: verify(path), times=1)
    copy = path.with_name("copy.db")
    await asyncio.to_thread(shutil.copy, path, copy)
    found["delete half"] = await cpu_ms(lambda: delete_half(copy, events), times=1)
    await verify(copy)
    size = await asyncio.to_thread(path.stat)
    return Size(events, found, size.st_size / events)


async def delete_half(path: Path, events: int) -> None:
    """As retention does it."""
    now = time_of(f"run-{events // EVENTS_OF_RUN // 2}") + DAY_S
    async with started(path) as (storage, journal):
        retention = Retention(
            storage.retention,
            journal,
            FixedClock(now),
            RetentionPeriods.of_days(1, None),
            plans_in_use=lambda: (),
        )
        await retention.prune()


class FixedClock:
    """A Clock that stands still."""

    def __init__(self, now: float) -> None:
        self._now = now

    def now(self) -> float:
        """See Clock."""
        return self._now

    def monotonic(self) -> float:
        """See Clock."""
        return self._now


async def verify(path: Path) -> None:
    """Raises RuntimeError if what was written here is found altered."""
    if altered := (await verify_journal(path)).alterations:
        raise RuntimeError(f"{len(altered)} alterations, such as: {altered[0]}")


def too_fast(smaller: Size, larger: Size) -> list[str]:
    """What grew faster than the journal."""
    share = larger.events / smaller.events * SLACK
    return [name for name, cost in larger.cpu_ms.items() if cost > share * smaller.cpu_ms[name]]


async def main(largest: int, folder: Path) -> int:
    """The exit status."""
    sizes: list[Size] = []
    events, failed = SMALLEST, False
    while events <= largest:
        sizes.append(await measured(folder / "journal.db", events))
        if len(sizes) == 1:
            print_line(f"{'events':>12}" + "".join(f"{name:>15}" for name in sizes[0].cpu_ms) + f"{'on disk':>15}")
        costs = "".join(f"{cost:>12,.1f} ms" for cost in sizes[-1].cpu_ms.values())
        print_line(f"{events:>12,}{costs}{sizes[-1].bytes_per_event:>9,.0f} bytes")
        for name in too_fast(sizes[-2], sizes[-1]) if len(sizes) > 1 else ():
            print_line(f"{name}: grew faster than the journal")
            failed = True
        events *= 10
    return int(failed)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m bench.growth", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--largest", type=int, default=1_000_000)
    parser.add_argument("--folder", type=Path, help="where the journal is made; it is deleted in the end")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.folder) as made:
        sys.exit(asyncio.run(main(given.largest, Path(made))))
