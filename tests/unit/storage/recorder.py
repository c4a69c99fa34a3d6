"""A process that records without end and says the number of each event once record() has returned it.

Usage: python -m tests.unit.storage.recorder JOURNAL
"""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from app.services.clock import SystemClock
from app.services.journal import Journal
from app.storage import open_storage
from tests.support.events import item

TASKS = 8


async def record(journal: Journal, task: int) -> None:
    number = 0
    while True:
        number += 1
        event = journal.new_event(item(number, f"{task} {'x' * 300}"))
        (stored,) = await journal.record(event)
        sys.stdout.write(f"{stored.seq} {task} {number}\n")
        sys.stdout.flush()


async def main(path: Path) -> None:
    async with open_storage(path) as storage:
        journal = Journal(storage.events, SystemClock())
        await journal.start()
        await asyncio.gather(*(record(journal, task) for task in range(TASKS)))


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1])))
