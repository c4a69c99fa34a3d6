"""How the file is opened."""

from __future__ import annotations

import asyncio
import sqlite3
import threading
from collections.abc import AsyncIterator
from contextlib import closing
from pathlib import Path

import pytest
import sqlalchemy as sa

from app.domain.errors import RecordRefusedError, StorageError
from app.storage.database import CACHE_KIB, Database
from app.storage.migrate import migrate
from app.storage.schema import GATEWAY
from tests.support.busy_pool import busy_default_pool

FULL = 2


@pytest.fixture
async def database(tmp_path: Path) -> AsyncIterator[Database]:
    path = tmp_path / "journal.db"
    migrate(path)
    database = Database(path)
    yield database
    await database.close()


def insert(connection: sa.Connection) -> None:
    connection.execute(sa.insert(GATEWAY), {"only": 1, "id": "gw-1"})


def append_one(connection: sqlite3.Connection) -> None:
    connection.execute("INSERT INTO gateway VALUES (1, 'gw-1')")


async def gateways(database: Database) -> int:
    return len(await database.read(sa.select(GATEWAY.c.id)))


@pytest.mark.parametrize(
    ("pragma", "value"), [("synchronous", FULL), ("journal_mode", "wal"), ("foreign_keys", 1), ("busy_timeout", 5000)]
)
async def test_a_commit_is_on_disk_and_keys_are_checked(database: Database, pragma: str, value: object) -> None:
    answer = await database.write(lambda connection: connection.exec_driver_sql(f"PRAGMA {pragma}").scalar_one())
    assert answer == value
    assert await database.append(lambda appender: appender.execute(f"PRAGMA {pragma}").fetchone()) == (value,)


async def test_a_reader_cannot_write(database: Database) -> None:
    await database.write(insert)
    with pytest.raises(StorageError, match="read-only"):
        await database.read(sa.delete(GATEWAY).returning(GATEWAY.c.id))  # type: ignore[arg-type]
    with pytest.raises(StorageError, match="read-only"):
        await database.read_at_once(append_one)
    assert await gateways(database) == 1


async def test_what_is_read_at_once_is_of_one_moment(database: Database) -> None:
    begun, committed = threading.Event(), threading.Event()

    def look_twice(connection: sqlite3.Connection) -> list[int]:
        counts = [connection.execute("SELECT count(*) FROM gateway").fetchone()[0]]
        begun.set()
        assert committed.wait(10)
        return [*counts, connection.execute("SELECT count(*) FROM gateway").fetchone()[0]]

    looking = asyncio.create_task(database.read_at_once(look_twice))
    await asyncio.to_thread(begun.wait, 10)
    await database.append(append_one)
    committed.set()
    assert await looking == [0, 0]
    assert await gateways(database) == 1


async def test_readers_see_the_last_commit_while_a_write_goes_on(database: Database) -> None:
    inserted, looked = threading.Event(), threading.Event()

    def insert_slowly(connection: sa.Connection) -> None:
        insert(connection)
        inserted.set()
        assert looked.wait(10)

    writing = asyncio.create_task(database.write(insert_slowly))
    await asyncio.to_thread(inserted.wait, 10)
    async with asyncio.timeout(2):
        assert await gateways(database) == 0
    looked.set()
    await writing
    assert await gateways(database) == 1


async def test_work_that_raises_is_undone(database: Database) -> None:
    def insert_then_fail(connection: sa.Connection) -> None:
        insert(connection)
        raise RuntimeError

    with pytest.raises(RuntimeError):
        await database.write(insert_then_fail)
    assert await gateways(database) == 0


async def test_an_append_is_committed_or_undone_whole(database: Database) -> None:
    def insert_then_fail(connection: sqlite3.Connection) -> None:
        append_one(connection)
        raise RuntimeError

    with pytest.raises(RuntimeError):
        await database.append(insert_then_fail)
    assert await gateways(database) == 0
    await database.append(append_one)
    assert await gateways(database) == 1


async def test_one_write_waits_for_another_programs_lock_and_the_next_ones_only_look(
    database: Database,
) -> None:
    with closing(sqlite3.connect(database.path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StorageError, match="another program has locked it"):
            await database.append(append_one)
        async with asyncio.timeout(10.0):
            for _ in range(10):
                with pytest.raises(StorageError, match="another program has locked it"):
                    await database.append(append_one)
                with pytest.raises(StorageError, match="another program has locked it"):
                    await database.write(insert)
        other.execute("ROLLBACK")
    await database.append(append_one)
    assert await database.append(lambda one: one.execute("PRAGMA busy_timeout").fetchone()) == (5000,)


async def test_a_constraint_is_told_as_the_fault_of_one_call(database: Database) -> None:
    await database.append(append_one)
    with pytest.raises(RecordRefusedError, match="constraint"):
        await database.append(append_one)


async def test_an_append_waits_for_a_write_that_goes_on(database: Database) -> None:
    inserted, go_on = threading.Event(), threading.Event()

    def insert_slowly(connection: sa.Connection) -> None:
        insert(connection)
        inserted.set()
        assert go_on.wait(10)

    writing = asyncio.create_task(database.write(insert_slowly))
    await asyncio.to_thread(inserted.wait, 10)
    appending = asyncio.create_task(database.append(lambda one: one.execute("DELETE FROM gateway").close()))
    await asyncio.wait({appending}, timeout=0.2)
    assert not appending.done()
    go_on.set()
    await asyncio.gather(writing, appending)
    assert await gateways(database) == 0


async def test_a_write_whose_caller_gives_up_goes_on_to_its_end_and_close_waits_for_it(database: Database) -> None:
    begun, go_on, ended = threading.Event(), threading.Event(), threading.Event()

    def insert_slowly(connection: sa.Connection) -> None:
        begun.set()
        assert go_on.wait(10)
        insert(connection)
        ended.set()

    writing = asyncio.create_task(database.write(insert_slowly))
    await asyncio.to_thread(begun.wait, 10)
    writing.cancel()
    with pytest.raises(asyncio.CancelledError):
        await writing
    ending = asyncio.create_task(database.close())
    await asyncio.sleep(0)
    go_on.set()
    await ending
    assert ended.is_set()
    with closing(sqlite3.connect(database.path)) as other:
        assert other.execute("SELECT count(*) FROM gateway").fetchone() == (1,)


async def test_closing_does_not_wait_for_the_work_of_others(database: Database) -> None:
    await database.write(insert)
    assert await gateways(database) == 1
    async with busy_default_pool() as other:
        async with asyncio.timeout(20.0):
            await database.close()
        assert not other.done()


async def test_a_lock_of_another_program_is_waited_for(database: Database) -> None:
    with closing(sqlite3.connect(database.path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        writing = asyncio.create_task(database.write(insert))
        await asyncio.wait({writing}, timeout=0.2)
        assert not writing.done()
        other.execute("COMMIT")
        await asyncio.wait_for(writing, 5)


async def test_what_is_cached_of_a_journal_is_bounded(database: Database) -> None:
    pragma = "PRAGMA cache_size"
    assert await database.write(lambda one: one.exec_driver_sql(pragma).scalar_one()) == -CACHE_KIB
    assert await database.append(lambda one: one.execute(pragma).fetchone()) == (-CACHE_KIB,)


async def test_closing_folds_the_log_into_the_file(database: Database) -> None:
    await database.write(insert)
    await database.close()
    assert not database.path.with_name("journal.db-wal").exists()
