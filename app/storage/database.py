"""One SQLite file: a connection that writes and a few that read."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias, TypeVar

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine, create_async_engine

from app.storage.errors import storage_errors

T = TypeVar("T")
Work: TypeAlias = Callable[[AsyncConnection], Awaitable[T]]

BUSY_TIMEOUT_MS: Final = 5000
READERS: Final = 3

# FULL and not NORMAL: in WAL mode NORMAL syncs only at checkpoints, so a power cut takes back the newest commits.
# A drop command is recorded before it is sent; if that record were lost, the restart could drop again.
_PRAGMAS: Final = (
    f"PRAGMA busy_timeout = {BUSY_TIMEOUT_MS}",
    "PRAGMA synchronous = FULL",
    "PRAGMA foreign_keys = ON",
    f"PRAGMA journal_size_limit = {64 * 1024 * 1024}",
)


class Database:
    """`write` works on the one connection that writes, `read` on one that cannot.

    One writer by construction: writes queue in this process and never meet SQLITE_BUSY from each other. Readers do
    not block it nor does it block them: migrate.py has put the file in WAL mode, which the file keeps.
    """

    def __init__(self, path: Path) -> None:
        self.path: Final = path
        self._going_on: set[asyncio.Task[Any]] = set()
        self._writer: Final = _engine(path, connections=1, pragmas=_PRAGMAS)
        self._reader: Final = _engine(path, connections=READERS, pragmas=(*_PRAGMAS, "PRAGMA query_only = ON"))

    async def write(self, work: Work[T]) -> T:
        """Do `work` in a transaction: committed and on disk when this returns, undone if it raises.

        The transaction begins with the first statement that writes; write first, then read what that gave.
        If the caller is cancelled, the transaction goes on to its end. Raises StorageError.
        """
        return await self._to_its_end(self._write(work))

    async def read(self, query: sa.Select[Any]) -> Sequence[sa.RowMapping]:
        """The rows of a query that sees all that is committed. Raises StorageError."""
        return await self._to_its_end(self._read(query))

    async def close(self) -> None:
        """Wait for what goes on, close all connections; SQLite then folds the WAL into the file. Idempotent."""
        while self._going_on:
            await asyncio.wait(self._going_on)
        await self._reader.dispose()
        await self._writer.dispose()

    async def _write(self, work: Work[T]) -> T:
        with storage_errors(self.path):
            async with self._writer.begin() as connection:
                return await work(connection)

    async def _read(self, query: sa.Select[Any]) -> Sequence[sa.RowMapping]:
        with storage_errors(self.path):
            async with self._reader.connect() as connection:
                rows: Sequence[sa.RowMapping] = (await connection.execute(query)).mappings().all()
                return rows

    async def _to_its_end(self, work: Coroutine[Any, Any, T]) -> T:
        # a cancelled statement goes on in the driver's thread; its connection, dropped meanwhile, keeps the write lock
        task = asyncio.create_task(work)
        self._going_on.add(task)
        task.add_done_callback(self._going_on.discard)
        return await asyncio.shield(task)


def _engine(path: Path, *, connections: int, pragmas: tuple[str, ...]) -> AsyncEngine:
    engine = create_async_engine(
        sa.URL.create("sqlite+aiosqlite", database=str(path)),
        pool_size=connections,
        max_overflow=0,
        # the driver begins a transaction at the first statement that writes, and takes the write lock right there; it
        # commits or rolls back when the block ends, so that a second rollback for the pool would only cost time
        connect_args={"isolation_level": "IMMEDIATE"},
        pool_reset_on_return=None,
    )

    def set_pragmas(connection: Any, _record: object) -> None:
        cursor = connection.cursor()
        for pragma in pragmas:
            cursor.execute(pragma)
        cursor.close()

    sa.event.listen(engine.sync_engine, "connect", set_pragmas)
    return engine
