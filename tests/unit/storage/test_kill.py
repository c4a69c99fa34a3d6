"""kill -9 in mid-write loses nothing that was confirmed, and leaves no gap."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from app.domain.events import Event
from app.storage import open_storage
from tests.support.events import data_of
from tests.support.stored_samples import event

ROUNDS = 4


def record_then_kill(journal: Path, confirmations: int) -> list[tuple[int, int, int]]:
    """Kill a recorder after so many confirmations; all that it confirmed as (seq, task, number)."""
    command = [sys.executable, "-m", "tests.unit.storage.recorder", str(journal)]
    lines = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            lines += [process.stdout.readline() for _ in range(confirmations)]
        finally:
            process.kill()
        lines += process.stdout.readlines()  # what it confirmed before it died
    whole = [line.split() for line in lines if line.endswith("\n")]
    return [(int(seq), int(task), int(number)) for seq, task, number in whole]


async def test_what_was_confirmed_is_there_after_a_kill(tmp_path: Path) -> None:
    journal = tmp_path / "journal.db"
    confirmed: list[tuple[int, int, int]] = []
    for round_ in range(ROUNDS):
        new = record_then_kill(journal, confirmations=40 + 7 * round_)
        assert new
        confirmed += new
    events: list[Event] = []
    async with open_storage(journal) as storage:
        while page := await storage.events.read(after=len(events), limit=1000):
            events += page
        (after,) = await storage.events.append([event()])
    assert [stored.seq for stored in events] == list(range(1, len(events) + 1))
    for seq, task, number in confirmed:
        stored = events[seq - 1]
        told = data_of(stored)
        assert (stored.seq, int(told["item_id"].split()[0]), told["seq"]) == (seq, task, number)
    assert after.seq == len(events) + 1
    assert len({seq for seq, _, _ in confirmed}) == len(confirmed)
