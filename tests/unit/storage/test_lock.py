"""One Waydrop per journal; the lock of a dead one is no obstacle."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.storage import open_storage
from app.storage.database import exclusive_lock, lock_path

HOLDER = """
import asyncio, sys
from pathlib import Path
from app.storage import open_storage

async def hold() -> None:
    async with open_storage(Path(sys.argv[1])):
        sys.stdout.write("held\\n")
        sys.stdout.flush()
        await asyncio.sleep(60)

asyncio.run(hold())
"""


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "journal.db"


@pytest.fixture
def holder(journal: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that has the journal open."""
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(journal)], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "held\n"
            yield process
        finally:
            process.kill()


async def test_a_second_process_is_refused_and_told_which_one_holds_it(
    journal: Path, holder: subprocess.Popen[str]
) -> None:
    with pytest.raises(StorageError, match="another Waydrop uses this journal") as refused:
        async with open_storage(journal):
            pass
    assert f"process {holder.pid}" in refused.value.detail
    assert refused.value.hint


async def test_the_lock_of_a_killed_process_is_no_obstacle(journal: Path, holder: subprocess.Popen[str]) -> None:
    holder.kill()
    holder.wait(10)
    async with open_storage(journal) as storage:
        assert await storage.events.last_seq() == 0


async def test_a_second_open_in_the_same_process_is_refused(journal: Path) -> None:
    async with open_storage(journal):
        with pytest.raises(StorageError, match=f"process {os.getpid()}"):
            async with open_storage(journal):
                pass


async def test_a_refused_open_does_not_take_the_lock_from_its_holder(journal: Path) -> None:
    async with open_storage(journal):
        for _ in range(2):
            with pytest.raises(StorageError):
                async with open_storage(journal):
                    pass


async def test_the_lock_is_free_after_a_block_that_failed(journal: Path) -> None:
    with pytest.raises(RuntimeError):
        async with open_storage(journal):
            raise RuntimeError
    async with open_storage(journal):
        pass


def test_a_left_over_lock_file_locks_nothing(journal: Path) -> None:
    lock_path(journal).write_text("99999\n")
    with exclusive_lock(journal):
        assert lock_path(journal).read_text() == f"{os.getpid()}\n"


def test_the_folder_is_made(tmp_path: Path) -> None:
    with exclusive_lock(tmp_path / "var" / "lib" / "journal.db"):
        pass


def test_a_folder_that_cannot_be_made_is_a_storage_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="folder"), exclusive_lock(tmp_path / "file" / "journal.db"):
        pass


def test_a_lock_file_on_a_full_disk_is_a_storage_error_that_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "pwrite", full)
        with pytest.raises(StorageError, match="No space left") as caught, exclusive_lock(tmp_path / "journal.db"):
            pass
    assert "free space" in caught.value.hint
    with exclusive_lock(tmp_path / "journal.db"):
        pass
