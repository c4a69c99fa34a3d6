"""PostgreSQL and NATS for tests: real servers, each test with a database or a store of its own."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import asyncpg

from app.storage.postgres import open_cluster_storage
from tools.cluster_servers import NatsServer, PostgresServer, free_port, open_folder


class PostgresDatabases:
    """Databases on one server."""

    def __init__(self, server: PostgresServer) -> None:
        self.server = server
        self._count = 0
        self._with_tables = ""

    def new(self) -> str:
        """The URL of a new, empty database without tables."""
        self._count += 1
        name = f"test_{self._count}"
        asyncio.run(_execute(self.server.url, f"CREATE DATABASE {name}"))
        return self.server.url_of(name)

    def with_tables(self) -> str:
        """The URL of a database with empty tables: always the same one, emptied again."""
        if self._with_tables:
            asyncio.run(_execute(self._with_tables, _EMPTY))
        else:
            self._with_tables = self.new()
            asyncio.run(_make_tables(self._with_tables, self.server.folder / "secret.key"))
        return self._with_tables


_EMPTY = """
SET session_replication_role = replica;  -- without the triggers that keep events and plans
TRUNCATE gateways, events, plans, runs, jobs, job_queues, tokens, refusals, answers, webhooks, attachments;
UPDATE stream SET position = 0;
"""


async def _execute(url: str, statement: str) -> None:
    connection = await asyncpg.connect(url)
    try:
        await connection.execute(statement)
    finally:
        await connection.close()


async def _make_tables(url: str, key_file: Path) -> None:
    async with open_cluster_storage(url, key_file=key_file):
        pass


@contextmanager
def postgres_databases() -> Iterator[PostgresDatabases]:
    """A PostgreSQL of its own for the block."""
    folder = open_folder()
    server = PostgresServer(folder / "postgres", free_port(), durable=False)
    try:
        server.start()
        yield PostgresDatabases(server)
    finally:
        server.kill()
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def nats_server() -> Iterator[NatsServer]:
    """A NATS server of its own for the block."""
    folder = open_folder()
    server = NatsServer(folder / "nats", free_port())
    try:
        server.start()
        yield server
    finally:
        server.stop()
        shutil.rmtree(folder, ignore_errors=True)
