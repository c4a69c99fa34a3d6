"""One SQLite file: a connection that writes and a few that read."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine, create_async_engine

from app.storage.errors import storage_errors

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
    """`write()` gives the one writing connection in a transaction, `read()` one that cannot write.

    One writer by construction: writes queue in this process and never meet SQLITE_BUSY from each other. Readers do
    not block it nor does it block them: migrate.py has put the file in WAL mode, which the file keeps.
    """

    def __init__(self, path: Path) -> None:
        self.path: Final = path
        self._writer: Final = _engine(path, connections=1, pragmas=_PRAGMAS)
        self._reader: Final = _engine(path, connections=READERS, pragmas=(*_PRAGMAS, "PRAGMA query_only = ON"))
        # IMMEDIATE takes the write lock at once: a transaction that reads, then writes, cannot find its read stale
        sa.event.listen(self._writer.sync_engine, "begin", _begin_immediate)

    @asynccontextmanager
    async def write(self) -> AsyncIterator[AsyncConnection]:
        """A transaction: committed and on disk when the block ends, undone if it raises. Raises StorageError."""
        with storage_errors(self.path):
            async with self._writer.begin() as connection:
                yield connection

    @asynccontextmanager
    async def read(self) -> AsyncIterator[AsyncConnection]:
        """A connection for one SELECT: it sees all that is committed. Raises StorageError."""
        with storage_errors(self.path):
            async with self._reader.connect() as connection:
                yield connection

    async def close(self) -> None:
        """Close all connections; SQLite then folds the WAL into the file. Idempotent."""
        await self._reader.dispose()
        await self._writer.dispose()


def _engine(path: Path, *, connections: int, pragmas: tuple[str, ...]) -> AsyncEngine:
    engine = create_async_engine(
        sa.URL.create("sqlite+aiosqlite", database=str(path)),
        pool_size=connections,
        max_overflow=0,
        # None: the driver begins no transactions by itself. Writes begin through the listener, reads need none.
        connect_args={"isolation_level": None},
    )

    def set_pragmas(connection: Any, _record: object) -> None:
        cursor = connection.cursor()
        for pragma in pragmas:
            cursor.execute(pragma)
        cursor.close()

    sa.event.listen(engine.sync_engine, "connect", set_pragmas)
    return engine


def _begin_immediate(connection: sa.Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE")
