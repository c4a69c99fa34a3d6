"""One SQLite file: two connections that write in turns, and a few that read."""

from __future__ import annotations

import asyncio
import fcntl
import json
import os
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Protocol, TypeAlias, TypeVar

import sqlalchemy as sa
from pydantic import BaseModel, ValidationError
from sqlalchemy.dialects import sqlite
from sqlalchemy.exc import DBAPIError

from app.domain.errors import InvalidInputError, RecordRefusedError, StorageError
from app.storage.private import private_folder

# primary result code (sqlite_errorname up to its second "_") -> what is wrong, how to fix it
_MEANING: Final[dict[str, tuple[str, str]]] = {
    "SQLITE_FULL": ("the disk is full", "free space on the volume of the journal; writing then continues"),
    "SQLITE_READONLY": (
        "it is read-only",
        "give the user that runs Waydrop write access to the file and its directory",
    ),
    "SQLITE_PERM": ("access is denied", "give the user that runs Waydrop write access to the file and its directory"),
    "SQLITE_CANTOPEN": ("it cannot be opened", "check that its directory exists and is writable"),
    "SQLITE_CORRUPT": ("the file is damaged", "stop Waydrop, keep the file for repair, and restore a backup"),
    "SQLITE_NOTADB": ("the file is not a journal", "use another file, or move this one"),
    "SQLITE_IOERR": ("the disk failed to read or write", "check the system log for disk errors"),
    "SQLITE_BUSY": ("another program has locked it", "close other programs that use the file, such as a sqlite3 shell"),
    "SQLITE_CONSTRAINT": (
        "the data violates a constraint of the journal",
        "this is a bug in Waydrop: please report it",
    ),
}


_OF_ONE_CALL: Final = ("SQLITE_CONSTRAINT", "SQLITE_TOOBIG", "SQLITE_MISMATCH", "SQLITE_ERROR")
"""What the data of a call may cause. The other errors are the file's."""

SHARED_MEMORY_BYTES: Final = 64 * 1024
"""What SQLite needs beside the file of a journal to open it."""


def storage_error(error: sqlite3.Error | BaseException | None, path: Path) -> StorageError:
    """The StorageError for an error of SQLite; `extra["sqlite"]` is SQLite's name for it, such as SQLITE_FULL."""
    name = str(getattr(error, "sqlite_errorname", "") or "SQLITE_ERROR")
    primary = "_".join(name.split("_")[:2])
    if primary == "SQLITE_IOERR" and _is_full(path.parent):
        primary = "SQLITE_FULL"  # so it says if there is no room for the shared memory of a journal
    meaning, hint = _MEANING.get(primary, ("the database refused", ""))
    kind = RecordRefusedError if primary in _OF_ONE_CALL else StorageError
    return kind(f"journal {path}: {meaning} ({error})", hint=hint, sqlite=name)


def _is_full(folder: Path) -> bool:
    try:
        found = os.statvfs(folder)
    except OSError:
        return False
    return found.f_bavail * found.f_frsize < SHARED_MEMORY_BYTES


@contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turn every error of the database into a StorageError that says what to do."""
    try:
        yield
    except DBAPIError as error:
        raise storage_error(error.orig, path) from error
    except sqlite3.Error as error:
        raise storage_error(error, path) from error


def no_journal(path: Path) -> StorageError:
    return StorageError(f"there is no journal at {path}", hint="specify the directory that Waydrop uses: --data-dir")


class JournalInUseError(StorageError):
    """Another process has the lock of the journal."""


def lock_path(journal: Path) -> Path:
    """The lock file of a journal; it stays on disk, only the lock on it comes and goes."""
    return journal.with_name(journal.name + ".lock")


@contextmanager
def exclusive_lock(journal: Path) -> Iterator[None]:
    """Lock the journal and create its directory for the duration of the block.

    The lock is flock(2): the kernel releases it when the holder dies, so it is never stale. The file is never deleted,
    because two processes could then lock two files of the same name.

    Raises:
        JournalInUseError: another process (or this one, a second time) has it.
        StorageError: the file cannot be created.
    """
    path = lock_path(journal)
    try:
        private_folder(path.parent)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise StorageError(
            f"journal {journal}: its directory is not writable ({error})",
            hint="give the user that runs Waydrop write access, or use another file",
        ) from error
    try:
        _take(handle, journal)
        yield
    finally:
        os.close(handle)  # drops the lock too


def _take(handle: int, journal: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        holder = os.pread(handle, 32, 0).decode("ascii", "replace").strip()
        raise JournalInUseError(
            f"another Waydrop uses this journal: {journal}" + (f" (process {holder})" if holder else ""),
            hint="stop it first, or use another journal",
            process=holder,
        ) from error
    except OSError as error:
        raise _no_lock(journal, error) from error
    try:
        os.ftruncate(handle, 0)
        os.pwrite(handle, f"{os.getpid()}\n".encode("ascii"), 0)
    except OSError as error:
        raise _no_lock(journal, error) from error


def _no_lock(journal: Path, error: OSError) -> StorageError:
    return StorageError(
        f"journal {journal}: its lock file cannot be written or locked: {error.strerror or error}",
        hint="free space on the volume of the journal, if it is full; a network file system needs flock",
    )


M = TypeVar("M", bound=BaseModel)

_ENCODER = json.JSONEncoder(allow_nan=False, separators=(",", ":"), ensure_ascii=False)


def to_json(what: str, value: Mapping[str, Any]) -> str:
    """`value` as compact JSON.

    Raises:
        InvalidInputError: it holds something that JSON has not (NaN, infinity, an object); nothing is stored then.
    """
    try:
        return _ENCODER.encode(value)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{what} cannot be stored: {error}") from error


def from_json(model: type[M], what: str, text: str) -> M:
    """The model stored as `text`. Raises StorageError if it does not fit the model any more."""
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        raise unreadable(what) from error


def object_from_json(what: str, text: str) -> dict[str, Any]:
    """The JSON object stored as `text`. Raises StorageError if it is none."""
    try:
        value = json.loads(text)
    except json.JSONDecodeError as error:
        raise unreadable(what) from error
    if not isinstance(value, dict):
        raise unreadable(what)
    return value


def unreadable(what: str) -> StorageError:
    """The error for a row that is there but means nothing to this version."""
    return StorageError(f"{what} cannot be read", hint="it was written by another version or edited")


def driver_sql(statement: sa.Insert) -> str:
    """The text of an insertion for sqlite3 itself. Columns are named parameters; `position` is left to SQLite."""
    columns = [column.name for column in statement.table.c if column.name != "position"]
    return str(statement.compile(dialect=sqlite.dialect(paramstyle="named"), column_keys=columns))


T = TypeVar("T")
Work: TypeAlias = Callable[[sa.Connection], T]


class TableAccess(Protocol):
    """Tables of schema.py: in a SQLite file, or in PostgreSQL. Each method may raise StorageError."""

    async def write(self, work: Work[T]) -> T:
        """Do `work` in a transaction: committed when this returns, undone if it raises."""

    async def read(self, query: sa.Select[Any]) -> Sequence[sa.RowMapping]:
        """The rows of a query that sees all that is committed."""


BUSY_TIMEOUT_MS: Final = 5000
"""Another program writes for a moment: until then no event is lost."""
LOCKED_TIMEOUT_MS: Final = 50
"""Once one write has waited in vain, the next ones only look whether the lock is gone."""
READERS: Final = 3
CACHE_KIB: Final = 1000
"""Of each connection. SQLite's own 2,000 fill up over hours as a journal grows; commits take no longer with these."""

_PATIENCE: Final = "PRAGMA busy_timeout = {}"
# FULL and not NORMAL: in WAL mode NORMAL syncs only at checkpoints, so a power cut takes back the newest commits.
# A drop command is recorded before it is sent; if that record were lost, the restart could drop again.
_PRAGMAS: Final = (
    _PATIENCE.format(BUSY_TIMEOUT_MS),
    "PRAGMA synchronous = FULL",
    "PRAGMA foreign_keys = ON",
    f"PRAGMA cache_size = -{CACHE_KIB}",
    f"PRAGMA journal_size_limit = {64 * 1024 * 1024}",
)
_READ_PRAGMAS: Final = (*_PRAGMAS, "PRAGMA query_only = ON")


class Database:
    """`write` and `append` work on connections that write, `read` and `read_at_once` on ones that cannot.

    One writer by construction: writes queue in this process and never meet SQLITE_BUSY from each other. Readers do
    not block it nor does it block them: migrate.py has put the file in WAL mode, which the file keeps.
    """

    def __init__(self, path: Path) -> None:
        self.path: Final = path
        self._going_on: set[asyncio.Future[Any]] = set()
        self._writer: Final = _Pool(path, connections=1, pragmas=_PRAGMAS)
        self._reader: Final = _Pool(path, connections=READERS, pragmas=_READ_PRAGMAS)
        self._appender: Final = _Visitor(path, _PRAGMAS, "BEGIN IMMEDIATE")
        self._looker: Final = _Visitor(path, _READ_PRAGMAS, "BEGIN")
        self._turn: Final = asyncio.Lock()  # of the two that write
        self._patience_ms = BUSY_TIMEOUT_MS

    async def write(self, work: Work[T]) -> T:
        """Do `work` in a transaction: committed and on disk when this returns, undone if it raises.

        The transaction begins with the first statement that writes; write first, then read what that gave.
        If the caller is cancelled, the transaction goes on to its end. Raises StorageError.
        """
        return await self._to_its_end(asyncio.create_task(self._write(work), name="journal write"))

    async def append(self, work: Callable[[sqlite3.Connection], T]) -> T:
        """As `write`; `work` does its whole transaction in one visit of a thread, for what is recorded all the time."""
        with storage_errors(self.path):
            await self._turn.acquire()
            try:  # at once, and not in a task: the caller's other work comes after
                committed = self._appender.run(work, self._patience_ms)
            except RuntimeError:  # closed
                self._turn.release()
                raise
            self._going_on.add(committed)
            committed.add_done_callback(self._appended)
            return await asyncio.shield(committed)

    async def read(self, query: sa.Select[Any]) -> Sequence[sa.RowMapping]:
        """The rows of a query that sees all that is committed. Raises StorageError."""
        return await self._to_its_end(self._reader.run(lambda connection: connection.execute(query).mappings().all()))

    async def read_at_once(self, work: Callable[[sqlite3.Connection], T]) -> T:
        """Read in one visit of a thread, for what is read all the time. All that `work` sees is of one moment.

        Raises StorageError.
        """
        return await self._to_its_end(self._looker.run(work))

    async def close(self) -> None:
        """Wait for what goes on, close all connections; SQLite then folds the WAL into the file. Idempotent."""
        while self._going_on:
            await asyncio.wait(self._going_on)
        await self._reader.close()
        await self._writer.close()
        await self._looker.close()
        await self._appender.close()

    async def _write(self, work: Work[T]) -> T:
        async with self._turn:
            committed = self._writer.run(work, self._patience_ms)
            committed.add_done_callback(self._learn_patience)
            return await committed

    def _appended(self, committed: asyncio.Future[Any]) -> None:
        self._learn_patience(committed)
        self._going_on.discard(committed)
        self._turn.release()

    def _learn_patience(self, committed: asyncio.Future[Any]) -> None:
        error = None if committed.cancelled() else committed.exception()
        cause = error.orig if isinstance(error, DBAPIError) else error
        is_locked = str(getattr(cause, "sqlite_errorname", "")).startswith("SQLITE_BUSY")
        self._patience_ms = LOCKED_TIMEOUT_MS if is_locked else BUSY_TIMEOUT_MS

    async def _to_its_end(self, visit: asyncio.Future[T]) -> T:
        self._going_on.add(visit)  # if its caller is cancelled, the thread works on, and may have the write lock
        visit.add_done_callback(self._going_on.discard)
        with storage_errors(self.path):
            return await asyncio.shield(visit)


class _Visitor:
    """SQLite's own connection in a thread of its own, for what is recorded and read all the time."""

    def __init__(self, path: Path, pragmas: Sequence[str], begin: str) -> None:
        self._path = path
        self._pragmas = pragmas
        self._begin = begin
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="journal")
        self._connection: sqlite3.Connection | None = None
        self._patience_ms = BUSY_TIMEOUT_MS

    def run(self, work: Callable[[sqlite3.Connection], T], patience_ms: int = BUSY_TIMEOUT_MS) -> asyncio.Future[T]:
        """Do `work` in a transaction."""
        return asyncio.get_running_loop().run_in_executor(self._thread, self._transact, work, patience_ms)

    async def close(self) -> None:
        """Idempotent."""
        self._thread.shutdown()  # idle: Database has waited. The default pool may be full of the work of others
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _transact(self, work: Callable[[sqlite3.Connection], T], patience_ms: int) -> T:
        connection = self._connection = self._connection or self._connect()
        if patience_ms != self._patience_ms:
            connection.execute(_PATIENCE.format(patience_ms))
            self._patience_ms = patience_ms
        connection.execute(self._begin)
        try:
            result = work(connection)
            connection.execute("COMMIT")
        except BaseException:
            if connection.in_transaction:
                connection.execute("ROLLBACK")
            raise
        return result

    def _connect(self) -> sqlite3.Connection:
        # the thread uses it alone, until it has ended
        connection = sqlite3.connect(self._path, isolation_level=None, check_same_thread=False)
        for pragma in self._pragmas:
            connection.execute(pragma)
        return connection


class _Pool:
    """SQLAlchemy's connections, each for one visit of a thread at a time.

    Not `sqlalchemy.ext.asyncio`: it imports the whole ORM, 6 MB, and needs a visit for each statement.
    """

    def __init__(self, path: Path, *, connections: int, pragmas: Sequence[str]) -> None:
        self._engine = _engine(path, connections, pragmas)
        self._threads = ThreadPoolExecutor(connections, thread_name_prefix="journal")

    def run(self, work: Work[T], patience_ms: int = BUSY_TIMEOUT_MS) -> asyncio.Future[T]:
        """Do `work` in a transaction."""
        return asyncio.get_running_loop().run_in_executor(self._threads, self._transact, work, patience_ms)

    async def close(self) -> None:
        """Idempotent."""
        self._threads.shutdown()  # idle, as above
        self._engine.dispose()

    def _transact(self, work: Work[T], patience_ms: int) -> T:
        with self._engine.begin() as connection:
            if patience_ms != connection.info.get("patience_ms", BUSY_TIMEOUT_MS):
                connection.exec_driver_sql(_PATIENCE.format(patience_ms))
                connection.info["patience_ms"] = patience_ms
            return work(connection)


def _engine(path: Path, connections: int, pragmas: Sequence[str]) -> sa.Engine:
    engine = sa.create_engine(
        sa.URL.create("sqlite", database=str(path)),
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

    sa.event.listen(engine, "connect", set_pragmas)
    return engine
