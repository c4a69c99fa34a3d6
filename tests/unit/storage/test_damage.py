"""What cannot be read is told as such, and never taken for something else."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.storage import open_storage
from tests.support.stored_samples import event, plan, run

PAGE_BYTES = 4096


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """A closed journal with a plan, a run and some pages of events."""
    path = tmp_path / "journal.db"
    async with open_storage(path) as storage:
        await storage.events.append([], plans=[plan()])
        await storage.events.append([event(n, item_id="x" * 1000) for n in range(200)], [run()])
    return path


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
