"""A full disk fails the record and nothing else: no gap, nothing half, and writing goes on once there is room."""

from __future__ import annotations

import json
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from app.domain.errors import StorageError
from app.storage.database import Database
from app.storage.events import SqliteEventStore
from app.storage.migrate import migrate
from app.storage.relay import RecentCommits
from tests.support.stored_samples import event

NAMESPACE = ["unshare", "--user", "--map-root-user", "--mount"]
MOUNT = 'mount -t tmpfs -o size=2m waydrop "$0"'


def leave_one_page(connection: sqlite3.Connection) -> None:
    (pages,) = connection.execute("PRAGMA page_count").fetchone()
    connection.execute(f"PRAGMA max_page_count = {pages + 1}")


async def test_an_append_that_finds_no_room_stores_nothing_and_the_next_small_one_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    migrate(path)
    database = Database(path)
    store = SqliteEventStore(database, "gw-1", RecentCommits())
    try:
        await store.append([event(1)])
        await database.append(leave_one_page)
        with pytest.raises(StorageError, match="the disk is full") as full:
            await store.append([event(2), event(3, item_id="x" * 100_000)])
        assert full.value.extra["sqlite"] == "SQLITE_FULL"
        assert await store.last_seq() == 1
        assert [stored.seq for stored in await store.append([event(4)])] == [2]
    finally:
        await database.close()


@pytest.fixture
def small_disk(tmp_path: Path) -> dict[str, Any]:
    """What a process saw on a real file system of 2 MB."""
    if (
        shutil.which("unshare") is None
        or subprocess.run([*NAMESPACE, "sh", "-c", MOUNT, str(tmp_path)], check=False, capture_output=True).returncode
    ):
        pytest.skip("this machine lets no test mount a file system")
    run = [*NAMESPACE, "sh", "-c", f'{MOUNT} && exec "$@"', str(tmp_path)]
    command = [*run, sys.executable, "-m", "tests.unit.storage.small_disk", str(tmp_path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    return dict(json.loads(done.stdout))


def test_a_full_file_system_is_told_and_survived(small_disk: dict[str, Any]) -> None:
    assert "the disk is full" in small_disk["detail"]
    assert "free space" in small_disk["hint"]
    assert small_disk["healthy_when_full"] is False
    assert small_disk["next_after_full"] == 1
    assert small_disk["gapless"] is True
    assert "is not writable" in small_disk["read_only"]
