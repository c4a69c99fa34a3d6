"""How long answers by Idempotency-Key are kept: a day of work, whatever the time of day does meanwhile."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from app.domain.events import NewEvent
from app.storage import open_storage
from tests.support.stored_samples import answer, event, item

DAY_S = 24 * 3600.0
JUMPS_S = [50 * 365 * DAY_S, -50 * 365 * DAY_S, 25 * 3600.0]


class Elapsed:
    """The monotonic clock of a process, moved on by the test."""

    def __init__(self) -> None:
        self.s = 1000.0

    def __call__(self) -> float:
        return self.s


@pytest.mark.parametrize("jump_s", JUMPS_S, ids=["from 1970", "to 1970", "by a day"])
async def test_a_jump_of_the_time_of_day_drops_no_answer(tmp_path: Path, jump_s: float) -> None:
    began = time.time()
    async with open_storage(tmp_path / "journal.db") as storage:
        for key, at in (("a", began), ("b", began + jump_s), ("c", began)):
            await storage.events.append([NewEvent.of(item(0), at)], answers=[answer(key)])
        for key in "abc":
            assert await storage.answers.get(key) == answer(key)


async def test_answers_go_after_a_day(tmp_path: Path) -> None:
    elapsed = Elapsed()
    async with open_storage(tmp_path / "journal.db", monotonic=elapsed) as storage:
        await storage.answers.put(answer("old"))
        elapsed.s += DAY_S
        await storage.events.append([event()], answers=[answer("new")])
        assert await storage.answers.get("old") == answer("old")
        elapsed.s += 1.0
        await storage.answers.put(answer("old", body=b"later"))
        assert await storage.answers.get("old") == answer("old", body=b"later"), "its key is free again"
        assert await storage.answers.get("new") == answer("new")


async def test_the_time_between_two_processes_does_not_count(tmp_path: Path) -> None:
    first, second = Elapsed(), Elapsed()
    async with open_storage(tmp_path / "journal.db", monotonic=first) as storage:
        await storage.answers.put(answer("old"))
        first.s += DAY_S / 2
        await storage.answers.put(answer("new"))
    async with open_storage(tmp_path / "journal.db", monotonic=second) as storage:
        second.s += DAY_S / 4
        await storage.answers.put(answer("newer"))
        assert await storage.answers.get("old") == answer("old")
        second.s += DAY_S / 2
        await storage.answers.put(answer("newest"))
        assert await storage.answers.get("old") is None
        assert await storage.answers.get("new") == answer("new")
