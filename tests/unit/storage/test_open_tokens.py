"""The command line makes and revokes tokens whether Waydrop runs or not."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.storage import open_storage, open_tokens
from tests.support.stored_samples import event, token


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "journal.db"


async def test_a_token_made_before_the_first_start_is_there(journal: Path) -> None:
    async with open_tokens(journal) as tokens:
        await tokens.add(token())
    async with open_storage(journal) as storage:
        assert await storage.tokens.find_by_hash("hash-1") == token()


async def test_a_token_made_and_revoked_beside_a_running_waydrop_is_seen_there(journal: Path) -> None:
    async with open_storage(journal) as storage:
        async with open_tokens(journal) as tokens:
            await tokens.add(token())
        await storage.events.append([event()])
        assert await storage.tokens.find_by_hash("hash-1") == token()
        async with open_tokens(journal) as tokens:
            assert await tokens.revoke("token-1", now=2000.0)
        assert await storage.tokens.find_by_hash("hash-1") is None
        assert (await storage.events.append([event()]))[0].seq == 2


async def test_beside_a_waydrop_of_another_version_nothing_is_touched(journal: Path) -> None:
    async with open_storage(journal):
        with closing(sqlite3.connect(journal)) as connection, connection:
            connection.execute("UPDATE alembic_version SET version_num = 'v9999'")
        with pytest.raises(StorageError, match="another version"):
            async with open_tokens(journal):
                pass


async def test_alone_it_holds_the_lock_so_that_no_start_comes_between(journal: Path) -> None:
    async with open_tokens(journal):
        with pytest.raises(StorageError, match="another Waydrop"):
            async with open_storage(journal):
                pass
