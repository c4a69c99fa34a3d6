"""What SQLite's error codes mean for the person who runs Waydrop."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError

from app.domain.errors import StorageError

# primary result code (sqlite_errorname up to its second "_") -> what is wrong, how to mend it
_MEANING: Final[dict[str, tuple[str, str]]] = {
    "SQLITE_FULL": ("the disk is full", "free space on the volume that holds the journal; writing then goes on"),
    "SQLITE_READONLY": (
        "it is read-only",
        "let the user that runs Waydrop write the file and its folder",
    ),
    "SQLITE_PERM": ("access is denied", "let the user that runs Waydrop write the file and its folder"),
    "SQLITE_CANTOPEN": ("it cannot be opened", "see that its folder exists and may be written"),
    "SQLITE_CORRUPT": ("the file is damaged", "stop Waydrop, keep the file for repair, and restore a backup"),
    "SQLITE_NOTADB": ("the file is not a journal", "name another file, or move this one away"),
    "SQLITE_IOERR": ("the disk failed to read or write", "see the system log for errors of the disk"),
    "SQLITE_BUSY": ("another program has locked it", "close other programs that use the file, such as a sqlite3 shell"),
    "SQLITE_CONSTRAINT": ("the data breaks a rule of the journal", "this is a defect of Waydrop: please report it"),
}


def storage_error(error: sqlite3.Error | BaseException | None, path: Path) -> StorageError:
    """The StorageError for an error of SQLite; `extra["sqlite"]` is SQLite's name for it, such as SQLITE_FULL."""
    name = str(getattr(error, "sqlite_errorname", "") or "SQLITE_ERROR")
    meaning, hint = _MEANING.get("_".join(name.split("_")[:2]), ("the database refused", ""))
    return StorageError(f"journal {path}: {meaning} ({error})", hint=hint, sqlite=name)


@contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turn every error of the database into a StorageError that says what to do."""
    try:
        yield
    except DBAPIError as error:
        raise storage_error(error.orig, path) from error
    except sqlite3.Error as error:
        raise storage_error(error, path) from error
    except PoolTimeoutError as error:
        raise StorageError(f"journal {path}: no connection became free in time", sqlite="") from error


def no_journal(path: Path) -> StorageError:
    """Somebody looks for a journal where there is none."""
    return StorageError(f"there is no journal at {path}", hint="name the folder that Waydrop uses: --data-dir")
