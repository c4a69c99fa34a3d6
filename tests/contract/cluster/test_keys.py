"""What a cluster knows of requests with an Idempotency-Key: who began them, and their answers, for a day."""

from __future__ import annotations

import asyncio
from pathlib import Path

import sqlalchemy as sa

from app.storage.postgres import open_cluster_storage
from app.storage.postgres.database import PostgresDatabase
from tests.support.cluster_servers import PostgresDatabases
from tests.support.stored_samples import answer, event


async def test_a_key_is_claimed_once_and_again_after_it_was_released(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    async with open_cluster_storage(url, key_file=tmp_path / "key") as cluster:
        claimed = await asyncio.gather(*(cluster.claims.claim("key-1") for _ in range(8)))
        assert claimed.count(True) == 1
        await cluster.claims.release("key-1")
        assert await cluster.claims.claim("key-1")
        assert not await cluster.claims.claim("key-1")
        await _age(url, "claims", "claimed_at")
        assert await cluster.claims.claim("key-2"), "old ones are dropped"
        assert await cluster.claims.claim("key-1")


async def test_an_answer_goes_after_a_day_of_the_servers_clock(tmp_path: Path, databases: PostgresDatabases) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    async with open_cluster_storage(url, key_file=tmp_path / "key") as cluster:
        await cluster.answers.put(answer("old"))
        await _age(url, "answers", "stored_at")
        await cluster.events.append([event()], answers=[answer("of a node in 1970")])
        await cluster.answers.put(answer("new"))
        assert await cluster.answers.get("old") is None
        assert await cluster.answers.get("of a node in 1970") is not None


async def _age(url: str, table: str, column: str) -> None:
    """Make all rows of a table a day older."""
    database = PostgresDatabase(url)
    older = sa.text(f"UPDATE {table} SET {column} = {column} - 86401")
    await database.write(lambda connection: connection.execute(older))
    await database.close()
