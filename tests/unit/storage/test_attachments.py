"""Attachments on the disk: whole or not at all, and found out when altered."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import sqlite3
from pathlib import Path

import pytest

from app.domain.errors import AttachmentAlteredError, AttachmentQuotaError, StorageError
from app.domain.events import NewEvent
from app.domain.events.run import RunAttachment
from app.domain.run.attachment import Attachment
from app.storage import open_storage, verify_journal
from app.storage.attachments import attachments_folder, file_path

PHOTO = b"\xff\xd8\xff photo"
HASH = hashlib.sha256(PHOTO).hexdigest()


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """A journal whose run has one attachment."""
    path = tmp_path / "journal.db"
    photo = Attachment(
        plan_item_id="drop", name="door.jpg", media_type="image/jpeg", size_bytes=9, sha256=HASH, at=1.0, actor="desk"
    )
    async with open_storage(path) as storage:
        await storage.attachments.put(HASH, PHOTO)
        await storage.events.append([NewEvent.of(RunAttachment(photo), 1.0, run_id="r1")])
    return path


def the_file(journal: Path) -> Path:
    return file_path(attachments_folder(journal), HASH)


async def test_an_intact_file_is_counted_and_nothing_else_lies_about(journal: Path) -> None:
    found = await verify_journal(journal)
    assert (found.attachments, found.alterations) == (1, [])
    files = await asyncio.to_thread(lambda: [one for one in attachments_folder(journal).rglob("*") if one.is_file()])
    assert files == [the_file(journal)]


@pytest.mark.parametrize("content", [b"\xff\xd8\xff photx", PHOTO + b"\0", b"", None])
async def test_an_altered_or_missing_file_is_named_by_verify_journal_and_never_given_out(
    journal: Path, content: bytes | None
) -> None:
    if content is None:
        await asyncio.to_thread(the_file(journal).unlink)
    else:
        await asyncio.to_thread(the_file(journal).write_bytes, content)
    found = await verify_journal(journal)
    assert [line.partition(":")[0] for line in found.alterations] == ["attachment door.jpg of drop drop of run r1"]
    async with open_storage(journal) as storage:
        with pytest.raises(AttachmentAlteredError):
            await storage.attachments.get(HASH)
        await storage.attachments.put(HASH, PHOTO)  # the uploader still had it
        assert await storage.attachments.get(HASH) == PHOTO


async def test_an_event_altered_to_another_file_breaks_the_chain(journal: Path, tmp_path: Path) -> None:
    other = b"\xff\xd8\xff another"
    forged = hashlib.sha256(other).hexdigest()
    async with open_storage(journal) as storage:
        await storage.attachments.put(forged, other)
    with contextlib.closing(sqlite3.connect(journal)) as connection, connection:
        connection.execute("DROP TRIGGER events_never_change")
        connection.execute("UPDATE events SET data = replace(data, ?, ?)", (HASH, forged))
    assert any("its hash is wrong" in line for line in (await verify_journal(journal)).alterations)


async def test_a_disk_that_takes_nothing_is_a_storage_error(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    await asyncio.to_thread(attachments_folder(path).write_text, "a file in the folder's place")
    async with open_storage(path) as storage:
        with pytest.raises(StorageError, match="attachments"):
            await storage.attachments.put(HASH, PHOTO)


async def test_what_a_kill_left_half_written_is_gone_after_the_next_start_and_nothing_else(
    journal: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = b"\xff\xd8\xff cut off"
    folder, sha256 = attachments_folder(journal), hashlib.sha256(other).hexdigest()

    def killed(path: Path, *_: object, **__: object) -> None:
        raise OSError("from here on nothing of the process runs")

    async with open_storage(journal) as storage:
        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", killed)
            patch.setattr(Path, "unlink", killed)
            with pytest.raises(StorageError):
                await storage.attachments.put(sha256, other)
    left = await asyncio.to_thread(lambda: [one for one in folder.rglob(".*") if one.is_file()])
    assert [one.parent.name for one in left] == [sha256[:2]], "the half written one"
    foreign = the_file(journal).with_name(".notes.part")
    await asyncio.to_thread(foreign.write_text, "an administrator's")
    async with open_storage(journal) as storage:
        assert await storage.attachments.get(HASH) == PHOTO
    files = await asyncio.to_thread(lambda: {one for one in folder.rglob("*") if one.is_file()})
    assert files == {the_file(journal), foreign}


async def test_files_have_a_quota_over_restarts_and_one_that_is_there_takes_no_more(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    other = b"\xff\xd8\xff other"
    async with open_storage(path, attachments_max_bytes=len(PHOTO) + 3) as storage:
        await storage.attachments.put(HASH, PHOTO)
        await storage.attachments.put(HASH, PHOTO)
        with pytest.raises(AttachmentQuotaError):
            await storage.attachments.put(hashlib.sha256(other).hexdigest(), other)
    async with open_storage(path, attachments_max_bytes=len(PHOTO) + 3) as storage:
        with pytest.raises(AttachmentQuotaError):
            await storage.attachments.put(hashlib.sha256(other).hexdigest(), other)
        assert await storage.attachments.get(HASH) == PHOTO
    async with open_storage(path, attachments_max_bytes=len(PHOTO + other)) as storage:
        await storage.attachments.put(hashlib.sha256(other).hexdigest(), other)
