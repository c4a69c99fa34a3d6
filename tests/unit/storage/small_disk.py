"""A process that meets a full disk and a read-only one, and prints what it saw as JSON.

Usage, inside a mount namespace of its own: python -m tests.unit.storage.small_disk FOLDER, a small file system.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from app.domain.errors import StorageError
from app.services.clock import SystemClock
from app.services.journal import Journal
from app.storage import open_storage
from tests.support.events import item

BALLAST_BYTES = 256 * 1024


async def fill(journal: Journal) -> StorageError:
    """Record until the disk is full."""
    for _ in range(10_000):
        try:
            await journal.record(journal.new_event(item(0, "x" * 4000)))
        except StorageError as error:
            return error
    raise AssertionError("the disk did not fill")


async def meet_a_full_disk(folder: Path) -> dict[str, Any]:
    ballast = folder / "ballast"
    ballast.write_bytes(bytes(BALLAST_BYTES))
    async with open_storage(folder / "journal.db") as storage:
        journal = Journal(storage.events, SystemClock())
        await journal.start()
        subscription = journal.subscribe(10_000)
        error = await fill(journal)
        healthy_when_full = journal.healthy
        confirmed = journal.last_seq
        ballast.unlink()
        (stored,) = await journal.record(journal.new_event(item()))
        await journal.close()
        seen = [(await subscription.get()).seq for _ in range(stored.seq)]
        kept = [event.seq for event in await storage.events.read(after=0, limit=100_000)]
        return {
            "detail": error.detail,
            "hint": error.hint,
            "healthy_when_full": healthy_when_full,
            "next_after_full": stored.seq - confirmed,
            "gapless": kept == list(range(1, stored.seq + 1)) == seen,
        }


async def meet_a_read_only_disk(folder: Path) -> str:
    # a file system of the kernel's own: only root of its namespace can do that, which is why this is a process
    await asyncio.to_thread(subprocess.run, ["mount", "-o", "remount,ro", str(folder)], check=True)
    try:
        async with open_storage(folder / "journal.db"):
            return "opened"
    except StorageError as error:
        return error.detail


async def main(folder: Path) -> None:
    report = await meet_a_full_disk(folder)
    report["read_only"] = await meet_a_read_only_disk(folder)
    sys.stdout.write(json.dumps(report))


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1])))
