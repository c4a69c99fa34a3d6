"""What is kept beside the journal: modes, the key of secrets, and the marker that access tokens were created."""

from __future__ import annotations

import os
import shutil
import sqlite3
import stat
from collections.abc import Callable, Iterator
from contextlib import AbstractAsyncContextManager, closing
from errno import ENOSPC, EPERM
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.domain.webhooks.webhook import Progress, StoredWebhook, Webhook
from app.storage import open_flight_log, open_storage, open_tokens
from app.storage.private import SecretBox, secret_box, tokens_marker
from tests.support.stored_samples import event, token

SECRET = "whsec_a-secret-that-signs-messages"


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "data" / "waydrop.db"


@pytest.fixture
def careless_umask() -> Iterator[None]:
    before = os.umask(0)
    yield
    os.umask(before)


def webhook() -> StoredWebhook:
    hook = Webhook(id="hook-1", url="https://dispatch.example/", created_at=1.0, created_by="admin")
    return StoredWebhook(hook, SECRET, Progress(cursor=0))


def lose(journal: Path, loss: str, *, other: Path) -> None:
    """What happens to a journal."""
    if loss == "replaced":
        other.replace(journal)
    else:
        journal.unlink()
    if loss == "emptied":
        journal.touch()


def all_bytes(folder: Path) -> bytes:
    """Everything that is stored, but for the key."""
    return b"".join(path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix != ".key")


@pytest.mark.usefixtures("careless_umask")
async def test_all_that_is_written_is_for_its_owner_alone(journal: Path) -> None:
    async with open_storage(journal) as storage:
        await storage.tokens.add(token())
        await storage.webhooks.add(webhook())
        await storage.attachments.put("ab" * 32, b"x")
        modes = {path: stat.S_IMODE(path.stat().st_mode) for path in journal.parent.rglob("*")}
    names = {path.name for path in modes}
    assert {"waydrop.db", "waydrop.db-wal", "waydrop.db.lock", "secret.key", "tokens-exist", "ab" * 32} <= names
    assert [str(path) for path, mode in modes.items() if mode != (0o700 if path.is_dir() else 0o600)] == []
    assert stat.S_IMODE(journal.parent.stat().st_mode) == 0o700


async def test_a_webhooks_secret_is_nowhere_on_the_disk(journal: Path) -> None:
    async with open_storage(journal) as storage:
        await storage.webhooks.add(webhook())
        assert SECRET.encode() not in all_bytes(journal.parent)
    async with open_storage(journal) as storage:
        assert list(await storage.webhooks.list_webhooks()) == [webhook()]
    assert SECRET.encode() not in all_bytes(journal.parent)


async def test_a_secret_of_an_older_version_is_encrypted_and_overwritten(journal: Path) -> None:
    async with open_storage(journal) as storage:
        await storage.webhooks.add(webhook())
    with closing(sqlite3.connect(journal)) as connection, connection:
        connection.execute("UPDATE webhooks SET secret = ?", (SECRET,))
    assert SECRET.encode() in all_bytes(journal.parent)
    async with open_storage(journal) as storage:
        assert list(await storage.webhooks.list_webhooks()) == [webhook()]
    assert SECRET.encode() not in all_bytes(journal.parent)


async def test_the_key_may_lie_elsewhere_and_without_it_the_secret_is_lost_and_nothing_else(journal: Path) -> None:
    elsewhere = journal.parent.parent / "usb-stick.key"
    async with open_storage(journal, key_file=elsewhere) as storage:
        await storage.webhooks.add(webhook())
    assert not journal.with_name("secret.key").exists()
    elsewhere.rename(elsewhere.with_suffix(".away"))
    async with open_storage(journal, key_file=elsewhere) as storage:
        (lost,) = await storage.webhooks.list_webhooks()
        assert (lost.hook, lost.secret) == (webhook().hook, None)
    elsewhere.with_suffix(".away").replace(elsewhere)
    async with open_storage(journal, key_file=elsewhere) as storage:
        assert list(await storage.webhooks.list_webhooks()) == [webhook()], "a key that is restored opens it again"


def test_an_altered_secret_opens_as_none(tmp_path: Path) -> None:
    box = secret_box(tmp_path / "a.key")
    sealed = box.seal(SECRET)
    assert box.open(sealed) == SECRET
    assert box.open(sealed[:-9] + "AAAAAAAA" + sealed[-1]) is None
    assert secret_box(tmp_path / "b.key").open(sealed) is None


@pytest.mark.parametrize("content", [b"", b"not a key", b"\xff" * 44])
def test_a_key_file_without_a_key_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "secret.key").write_bytes(content)
    with pytest.raises(StorageError, match="does not contain a key"):
        secret_box(tmp_path / "secret.key")


@pytest.mark.parametrize("step", ["fsync", "link"])
def test_a_full_disk_or_a_kill_leaves_no_empty_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    key = tmp_path / "secret.key"

    def fail(*_: object) -> None:
        assert not key.exists(), "a kill at this moment would leave it so"
        raise OSError(ENOSPC, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(os, step, fail)
        with pytest.raises(StorageError, match="No space left"):
            secret_box(key)
    assert list(tmp_path.iterdir()) == []
    assert secret_box(key).seal(SECRET), "there is room again"


def test_a_key_is_made_where_there_are_no_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise PermissionError(EPERM, "Operation not permitted")  # as vfat says

    monkeypatch.setattr(os, "link", fail)
    sealed = secret_box(tmp_path / "secret.key").seal(SECRET)
    assert secret_box(tmp_path / "secret.key").open(sealed) == SECRET


def test_a_key_is_made_once(tmp_path: Path) -> None:
    sealed = secret_box(tmp_path / "secret.key").seal(SECRET)
    again: SecretBox = secret_box(tmp_path / "secret.key")
    assert again.open(sealed) == SECRET


@pytest.mark.parametrize("by_command_line", [True, False])
@pytest.mark.parametrize("loss", ["emptied", "gone", "replaced"])
async def test_a_journal_that_lost_its_tokens_opens_for_nobody(
    journal: Path, tmp_path: Path, loss: str, *, by_command_line: bool
) -> None:
    async with open_tokens(journal) as tokens:
        await tokens.add(token())
    async with open_storage(tmp_path / "other" / "waydrop.db"):
        pass
    lose(journal, loss, other=tmp_path / "other" / "waydrop.db")
    with pytest.raises(StorageError, match="access tokens were created") as refused:
        async with open_tokens(journal) if by_command_line else open_storage(journal):
            pass
    assert str(tokens_marker(journal)) in refused.value.hint
    tokens_marker(journal).unlink()
    async with open_storage(journal) as storage:
        assert list(await storage.tokens.list_tokens()) == [], "whoever deletes the marker begins anew"


async def test_a_journal_of_an_older_version_with_tokens_gets_its_marker(journal: Path) -> None:
    async with open_tokens(journal) as tokens:
        await tokens.add(token())
    tokens_marker(journal).unlink()
    async with open_storage(journal):
        assert tokens_marker(journal).exists()


@pytest.mark.parametrize("loss", ["emptied", "gone"])
@pytest.mark.parametrize("opened", [open_storage, open_tokens, open_flight_log])
async def test_a_lost_journal_is_not_begun_anew_beside_its_write_ahead_log(
    journal: Path, opened: Callable[[Path], AbstractAsyncContextManager[object]], loss: str
) -> None:
    log = journal.with_name("waydrop.db-wal")
    async with open_storage(journal) as storage:
        await storage.events.append([event(1)])
        newest = log.read_bytes()
    lose(journal, loss, other=journal)
    log.write_bytes(newest)
    with pytest.raises(StorageError, match=r"it was lost|there is no journal"):
        async with opened(journal):
            pass
    assert log.read_bytes() == newest, "it may have the newest events"


async def test_a_lost_journal_is_not_begun_anew_beside_its_attachments(journal: Path) -> None:
    async with open_storage(journal) as storage:
        await storage.attachments.put("ab" * 32, b"x")
    lose(journal, "gone", other=journal)
    with pytest.raises(StorageError, match="attachments is not: it was lost") as refused:
        async with open_storage(journal):
            pass
    assert "backup" in refused.value.hint
    shutil.rmtree(journal.with_name("attachments"))
    async with open_storage(journal) as storage:
        assert await storage.events.last_seq() == 0, "whoever moves them away begins anew"


async def test_revoked_tokens_are_tokens(journal: Path) -> None:
    async with open_tokens(journal) as tokens:
        await tokens.add(token())
        await tokens.revoke("token-1", now=2.0)
    async with open_storage(journal) as storage:
        assert len(await storage.tokens.list_tokens()) == 1
