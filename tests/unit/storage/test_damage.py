"""What cannot be read is told as such, and never taken for something else."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.storage import open_storage
from app.storage.write_ahead_log import refuse_lost_commits
from tests.support.stored_samples import event, plan, run

PAGE_BYTES = 4096
COMMITS = 30


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """A closed journal with a plan, a run and some pages of events."""
    path = tmp_path / "journal.db"
    async with open_storage(path) as storage:
        await storage.events.append([], plans=[plan()])
        await storage.events.append([event(n, item_id="x" * 1000) for n in range(200)], [run()])
    return path


@pytest.fixture
async def killed(tmp_path: Path) -> Path:
    """A journal as a kill leaves it, with its newest commits in the log."""
    running, left = tmp_path / "running.db", tmp_path / "killed.db"
    async with open_storage(running) as storage:
        for number in range(COMMITS):
            await storage.events.append([event(number)])
        shutil.copy(running, left)
        shutil.copy(f"{running}-wal", f"{left}-wal")
    return left


def change(path: Path, statement: str) -> None:
    """Change the file behind Waydrop's back, as a person with a shell could."""
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("DROP TRIGGER plans_never_change")
        connection.execute("DROP TRIGGER events_never_change")
        connection.execute(statement)


def damage(path: Path) -> None:
    """Overwrite four pages in the middle, as a failing disk does."""
    content = bytearray(path.read_bytes())
    middle = len(content) // 2 // PAGE_BYTES * PAGE_BYTES
    content[middle : middle + 4 * PAGE_BYTES] = b"\xa5" * 4 * PAGE_BYTES
    path.write_bytes(content)


async def test_a_damaged_page_is_damage_and_not_the_end_of_the_journal(journal: Path) -> None:
    damage(journal)
    async with open_storage(journal) as storage:
        with pytest.raises(StorageError, match="damaged") as damaged:
            await storage.events.read(after=0, limit=1000)
    assert "backup" in damaged.value.hint


def damage_log(path: Path, at: float) -> None:
    """Overwrite a little of the log, at this share of it."""
    log = path.with_name(path.name + "-wal")
    content = bytearray(log.read_bytes())
    first = int(len(content) * at)
    content[first : first + 8] = b"\xa5" * 8
    log.write_bytes(content)


async def newest(path: Path) -> int:
    async with open_storage(path) as storage:
        return await storage.events.last_seq()


async def test_a_killed_journal_has_all_its_commits(killed: Path) -> None:
    assert await newest(killed) == COMMITS


@pytest.mark.parametrize("at", [0.0, 0.1, 0.5, 0.9])
async def test_commits_that_are_lost_in_a_damaged_log_are_told_until_somebody_acts(killed: Path, at: float) -> None:
    damage_log(killed, at)
    for _ in range(2):
        with pytest.raises(StorageError, match=r"killed.db-wal is damaged, and at least \d+ of the commits") as damaged:
            await newest(killed)
    assert "backup" in damaged.value.hint


async def test_a_commit_that_was_broken_off_is_no_damage(killed: Path) -> None:
    damage_log(killed, 0.999)
    assert await newest(killed) == COMMITS - 1


@pytest.mark.parametrize("missing_bytes", [0, 1])
async def test_commits_that_failed_are_no_damage(killed: Path, missing_bytes: int) -> None:
    """At their fsync, or as the disk was full: each began at the same frame, the shorter leaves the longer's end."""
    left = b""
    for events in (1, 40, 100):
        one = killed.with_name(f"{events}.db")
        shutil.copy(killed, one)
        shutil.copy(f"{killed}-wal", f"{one}-wal")
        with closing(sqlite3.connect(one, isolation_level=None)) as connection:
            connection.execute("UPDATE gateway SET id = hex(randomblob(?))", (events * PAGE_BYTES,))
            log = one.with_name(f"{one.name}-wal").read_bytes()
        assert len(log) > len(left)
        left += log[len(left) :]
    killed.with_name("killed.db-wal").write_bytes(left[: len(left) - missing_bytes])
    assert await newest(killed) == COMMITS


async def test_what_an_earlier_log_has_left_behind_this_one_is_no_damage(killed: Path) -> None:
    """SQLite writes a log from its beginning again once all of it is in the file."""
    log, again = killed.with_name("killed.db-wal"), killed.with_name("again.db")
    size = log.stat().st_size
    with closing(sqlite3.connect(killed, isolation_level=None)) as connection:
        connection.execute("PRAGMA wal_checkpoint(RESTART)")
        connection.execute("UPDATE gateway SET id = 'gw-2'")
        shutil.copy(killed, again)
        shutil.copy(log, f"{again}-wal")
    assert again.with_name("again.db-wal").stat().st_size == size
    assert await newest(again) == COMMITS


async def test_a_log_that_a_running_waydrop_begins_anew_meanwhile_is_no_damage(killed: Path) -> None:
    log = killed.with_name("killed.db-wal")
    with closing(sqlite3.connect(killed, isolation_level=None)) as running:
        running.execute("PRAGMA wal_checkpoint(RESTART)")
        looked_at = log.read_bytes()
        running.execute("UPDATE gateway SET id = 'gw-2'")
        log.write_bytes(looked_at)
        refuse_lost_commits(killed)


async def test_a_run_that_means_nothing_is_an_error(journal: Path) -> None:
    change(journal, """UPDATE runs SET document = json_set(document, '$.state', 'teleporting')""")
    async with open_storage(journal) as storage:
        with pytest.raises(StorageError, match="run run-1 cannot be read"):
            await storage.runs.get("run-1")


@pytest.mark.parametrize("document", ["'not json'", "'[1]'", "'null'"])
async def test_a_plan_that_is_no_document_is_an_error(journal: Path, document: str) -> None:
    change(journal, f"UPDATE plans SET document = {document}")
    async with open_storage(journal) as storage:
        with pytest.raises(StorageError, match="plan plan-1 cannot be read"):
            await storage.plans.get("plan-1")


@pytest.mark.parametrize("column", ["kind = 'nothing.known'", "data = 'not json'", "data = '[1]'"])
async def test_an_event_that_means_nothing_is_an_error(journal: Path, column: str) -> None:
    change(journal, f"UPDATE events SET {column} WHERE seq = 7")
    async with open_storage(journal) as storage:
        with pytest.raises(StorageError, match="event 7 cannot be read"):
            await storage.events.read(after=0, limit=10)
