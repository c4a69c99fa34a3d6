"""How the file is opened."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import AsyncIterator
from contextlib import closing
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.storage.database import Database
from app.storage.migrate import migrate

FULL = 2


@pytest.fixture
async def database(tmp_path: Path) -> AsyncIterator[Database]:
    path = tmp_path / "journal.db"
    migrate(path)
    database = Database(path)
    yield database
    await database.close()


@pytest.mark.parametrize(
    ("pragma", "value"), [("synchronous", FULL), ("journal_mode", "wal"), ("foreign_keys", 1), ("busy_timeout", 5000)]
)
async def test_a_commit_is_on_disk_and_keys_are_checked(database: Database, pragma: str, value: object) -> None:
    async with database.write() as connection:
        assert (await connection.exec_driver_sql(f"PRAGMA {pragma}")).scalar_one() == value


async def test_a_reader_cannot_write(database: Database) -> None:
    with pytest.raises(StorageError, match="read-only"):
        async with database.read() as connection:
            await connection.exec_driver_sql("DELETE FROM answers")


async def test_readers_see_the_last_commit_while_a_write_goes_on(database: Database) -> None:
    async with database.write() as writing:
        await writing.exec_driver_sql("INSERT INTO gateway VALUES (1, 'gw-1')")
        async with asyncio.timeout(2), database.read() as reading:
            assert (await reading.exec_driver_sql("SELECT count(*) FROM gateway")).scalar_one() == 0
    async with database.read() as reading:
        assert (await reading.exec_driver_sql("SELECT count(*) FROM gateway")).scalar_one() == 1


async def test_a_block_that_raises_is_undone(database: Database) -> None:
    async def insert_then_fail() -> None:
        async with database.write() as connection:
            await connection.exec_driver_sql("INSERT INTO gateway VALUES (1, 'gw-1')")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        await insert_then_fail()
    async with database.read() as reading:
        assert (await reading.exec_driver_sql("SELECT count(*) FROM gateway")).scalar_one() == 0


async def test_a_lock_of_another_program_is_waited_for(database: Database) -> None:
    with closing(sqlite3.connect(database.path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")

        async def write() -> None:
            async with database.write() as connection:
                await connection.exec_driver_sql("INSERT INTO gateway VALUES (1, 'gw-1')")

        writing = asyncio.create_task(write())
        await asyncio.wait({writing}, timeout=0.2)
        assert not writing.done()
        other.execute("COMMIT")
        await asyncio.wait_for(writing, 5)


async def test_closing_folds_the_log_into_the_file(database: Database) -> None:
    async with database.write() as connection:
        await connection.exec_driver_sql("INSERT INTO gateway VALUES (1, 'gw-1')")
    await database.close()
    assert not database.path.with_name("journal.db-wal").exists()
