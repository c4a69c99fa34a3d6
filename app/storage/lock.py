"""The lock that keeps a second Waydrop away from a journal."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.domain.errors import StorageError


class JournalInUseError(StorageError):
    """Another process holds the journal's lock."""


def lock_path(journal: Path) -> Path:
    """The lock file of a journal; it stays on disk, only the lock on it comes and goes."""
    return journal.with_name(journal.name + ".lock")


@contextmanager
def exclusive_lock(journal: Path) -> Iterator[None]:
    """Hold the journal's lock, and its folder's existence, for the duration of the block.

    The lock is flock(2): the kernel drops it when the holder dies, however it dies, so a lock is never stale. The
    file is never deleted, for that would let two holders lock two files of the same name.

    Raises:
        JournalInUseError: another process (or this one, a second time) holds it.
        StorageError: the file cannot be made.
    """
    path = lock_path(journal)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise StorageError(
            f"journal {journal}: its folder cannot be written ({error})",
            hint="give the user that runs Waydrop the right to write there, or name another file",
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
            hint="stop it first, or give this one a journal of its own",
            process=holder,
        ) from error
    os.ftruncate(handle, 0)
    os.pwrite(handle, f"{os.getpid()}\n".encode("ascii"), 0)
