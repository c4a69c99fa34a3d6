"""The log that SQLite writes commits to first. Of a damaged one it reads the beginning, and tells nobody."""

from __future__ import annotations

import sqlite3
import struct
from contextlib import closing
from itertools import pairwise
from pathlib import Path
from typing import Final

from app.domain.errors import StorageError
from app.storage.database import storage_errors

# https://www.sqlite.org/walformat.html
_HEADER: Final = struct.Struct(">8xI4x8s8x")
"""The bytes of a page; the salts, which the frames of this log have, and those that are left of an earlier one lack."""
_FRAME: Final = struct.Struct(">4xI8s8x")
"""Before each page. The first number is 0 but in the last frame of a commit."""
_CHECKSUM: Final = struct.Struct(">II")
"""Ends what is before each page."""
_INDEX: Final = struct.Struct("=16xI12x8s")
"""Begins the shared memory: how many frames SQLite reads, and the salts of their log, 0 if it takes it for none."""


def refuse_lost_commits(journal: Path) -> None:
    """Before anything writes to the journal, or takes its log into it. Blocking.

    A commit is written once the one before is on the disk, and confirmed once it is there itself. So a power cut breaks
    off one commit at most: of those that SQLite does not read, each that another one follows was confirmed. Nothing
    follows one that failed: the next begins at the same frame. That the newest commit itself was lost, nothing tells.

    Raises StorageError.
    """
    log, shared = (journal.with_name(journal.name + end) for end in ("-wal", "-shm"))
    if not log.exists() or log.stat().st_size < _HEADER.size:
        return
    uri = f"{journal.absolute().as_uri()}?mode=ro"  # one that may write would delete the log when it is closed
    with storage_errors(journal), closing(sqlite3.connect(uri, uri=True, isolation_level=None)) as connection:
        connection.execute("BEGIN")
        connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()
        salts, commits = _commits(log)
        read, salts_read = _INDEX.unpack_from(shared.read_bytes())
    if salts_read not in (salts, bytes(8)):
        return  # begun anew meanwhile, by a Waydrop that runs
    unread = [frame for frame in commits if frame >= read]
    if lost := sum(_follows(log, *two) for two in pairwise(unread)):
        raise StorageError(
            f"journal {journal}: {log} is damaged, and at least {lost} of the commits in it are lost",
            hint="keep a copy of both files, and restore a backup",
        )


def _commits(log: Path) -> tuple[bytes, list[int]]:
    """The salts of the log, and the last frame of each commit."""
    with log.open("rb") as file:
        page_bytes, salts = _HEADER.unpack(file.read(_HEADER.size))
        commits, frame = [], 0
        while len(header := file.read(_FRAME.size)) == _FRAME.size:
            is_last, of = _FRAME.unpack(header)
            if is_last and of == salts:
                commits.append(frame)
            file.seek(page_bytes, 1)
            frame += 1
    return salts, commits


def _follows(log: Path, before: int, last: int) -> bool:
    """Whether the checksums go on from one frame to the other: each sums up the frame and the checksum before it."""
    with log.open("rb") as file:
        page_bytes, _ = _HEADER.unpack(file.read(_HEADER.size))
        file.seek(before * (_FRAME.size + page_bytes), 1)
        checksum = _CHECKSUM.unpack_from(file.read(_FRAME.size + page_bytes), _FRAME.size - _CHECKSUM.size)
        for _ in range(before, last):
            frame, page = file.read(_FRAME.size), file.read(page_bytes)
            if len(page) < page_bytes:
                return False
            checksum = _sum_up(page, _sum_up(frame[:8], checksum))
            if checksum != _CHECKSUM.unpack_from(frame, _FRAME.size - _CHECKSUM.size):
                return False
    return True


def _sum_up(data: bytes, checksum: tuple[int, int]) -> tuple[int, int]:
    one, other = checksum
    for first, second in struct.iter_unpack("=II", data):  # the order of the machine that began the log
        one = (one + first + other) & 0xFFFFFFFF
        other = (other + second + one) & 0xFFFFFFFF
    return one, other
