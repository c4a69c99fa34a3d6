"""Attachments on disk: files beside the journal, named by their SHA-256; implements AttachmentStore."""

from __future__ import annotations

import asyncio
import hashlib
import os
import secrets
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

import sqlalchemy as sa

from app.domain.errors import AttachmentAlteredError, AttachmentQuotaError, StorageError
from app.domain.events import EventKind
from app.domain.run.attachment import Attachment, is_sha256
from app.storage.database import Database, from_json
from app.storage.private import FILE_MODE, private_folder, sync_folder
from app.storage.schema import EVENTS

ATTACHMENTS_MAX_BYTES: Final = 10 * 1024**3
_RANDOM_BYTES: Final = 8
_UNFINISHED: Final = ".{}.part"


def attachments_folder(journal: Path) -> Path:
    return journal.with_name("attachments")


def file_path(folder: Path, sha256: str) -> Path:
    """The path of a file: AB/ABCD..., so that no directory becomes too large. ValueError if it is not a hash."""
    if not is_sha256(sha256):
        raise ValueError(f"{sha256!r} is not a SHA-256 hash")
    return folder / sha256[:2] / sha256


def remove_unfinished(folder: Path) -> None:
    """Remove what a kill during `put` left behind. Only while nothing is being stored. Blocking."""
    for unfinished in folder.glob(f"??/{_UNFINISHED.format('?' * 2 * _RANDOM_BYTES)}"):
        with suppress(OSError):  # it only uses space: no reason to refuse a start
            unfinished.unlink()


def is_intact(folder: Path, sha256: str) -> bool:
    """Whether the file is there and has this hash. Blocking."""
    try:
        with file_path(folder, sha256).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest() == sha256
    except (OSError, ValueError):
        return False


def used_bytes(folder: Path) -> int:
    """The size of the files. Blocking."""
    return sum(file.stat().st_size for file in folder.glob("??/*") if file.is_file())


class DiskAttachmentStore:
    """AttachmentStore on a folder and the journal's events. Files are never changed, and deleted by retention alone."""

    def __init__(self, database: Database, folder: Path, max_bytes: int) -> None:
        self._database = database
        self._folder = folder
        self._max_bytes = max_bytes
        self._putting = threading.Lock()
        self._used_bytes: int | None = None

    async def put(self, sha256: str, content: bytes) -> None:
        """See AttachmentStore. One that was altered on the disk is replaced by the right one."""
        with self._disk_errors():
            await asyncio.to_thread(self._put_within_quota, sha256, content)

    async def get(self, sha256: str) -> bytes:
        content = await asyncio.to_thread(self._get, sha256)
        if content is None or hashlib.sha256(content).hexdigest() != sha256:
            raise AttachmentAlteredError(
                f"the stored file {sha256} differs from the attached file or is missing",
                hint="restore it from a backup; waydrop verify-journal lists all altered files",
            )
        return content

    async def is_intact(self, sha256: str) -> bool:
        return await asyncio.to_thread(is_intact, self._folder, sha256)

    async def has_older(self, time: float) -> bool:
        """Whether a file was last attached before `time`, in Unix seconds. Raises StorageError."""
        with self._disk_errors():
            return await asyncio.to_thread(lambda: any(_is_older(file, time) for file in self._folder.glob("??/*")))

    async def delete_older(self, time: float) -> None:
        """Delete these files. Raises StorageError."""
        with self._disk_errors():
            await asyncio.to_thread(self._delete_older, time)

    async def of_run(self, run_id: str) -> Sequence[Attachment]:
        of_run = sa.select(EVENTS.c.data).where(EVENTS.c.run_id == run_id).order_by(EVENTS.c.seq)
        rows = await self._database.read(of_run.where(EVENTS.c.kind == EventKind.RUN_ATTACHMENT.value))
        return tuple([from_json(Attachment, f"an attachment of run {run_id}", row["data"]) for row in rows])

    @contextmanager
    def _disk_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise StorageError(
                f"attachments in {self._folder}: {error.strerror or error}",
                hint="free space, and give the user that runs Waydrop write access",
            ) from error

    def _put_within_quota(self, sha256: str, content: bytes) -> None:
        with self._putting:
            if is_intact(self._folder, sha256):
                os.utime(file_path(self._folder, sha256))  # its age begins anew
                return
            if self._used_bytes is None:
                self._used_bytes = used_bytes(self._folder)
            if self._used_bytes + len(content) > self._max_bytes:
                raise AttachmentQuotaError(
                    f"attachments take {self._used_bytes} of {self._max_bytes} bytes: this one exceeds the limit",
                    hint="increase WAYDROP_ATTACHMENTS_MAX_BYTES if the disk has space",
                )
            replaces = file_path(self._folder, sha256).exists()  # one that was altered
            self._put(sha256, content)
            self._used_bytes = None if replaces else self._used_bytes + len(content)

    def _put(self, sha256: str, content: bytes) -> None:
        path = file_path(self._folder, sha256)
        private_folder(self._folder)
        private_folder(path.parent)
        unfinished = path.with_name(_UNFINISHED.format(secrets.token_hex(_RANDOM_BYTES)))
        try:
            with os.fdopen(os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL, FILE_MODE), "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)
        for folder in (path.parent, self._folder, self._folder.parent):
            sync_folder(folder)  # the names too must be on the disk before the event says that the file is there

    def _delete_older(self, time: float) -> None:
        for file in self._folder.glob("??/*"):
            with self._putting:  # a file that is attached again meanwhile is younger
                if _is_older(file, time):
                    file.unlink()
                    self._used_bytes = None

    def _get(self, sha256: str) -> bytes | None:
        try:
            return file_path(self._folder, sha256).read_bytes()
        except (OSError, ValueError):
            return None


def _is_older(file: Path, time: float) -> bool:
    # lstat: a link whose target is missing is an old file, too
    return is_sha256(file.name) and file.lstat().st_mtime < time
