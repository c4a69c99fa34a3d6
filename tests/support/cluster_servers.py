"""PostgreSQL and NATS for tests: real servers, each test with a database or a store of its own."""

from __future__ import annotations

import asyncio
import shutil
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import asyncpg

from app.storage.postgres import open_cluster_storage
from tools.cluster_servers import NatsServer, PostgresServer, open_folder


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


_TABLES = (
    "gateways", "events", "plans", "runs", "jobs", "job_queues",
    "tokens", "refusals", "answers", "claims", "webhooks", "attachments",
)  # fmt: skip
_EMPTY = f"""
SET session_replication_role = replica;  -- without the triggers that keep events and plans
{"".join(f"DELETE FROM {table};" for table in _TABLES)}
UPDATE stream SET position = 0;
"""
"""TRUNCATE takes ten times as long: it makes new files for each table and its indexes."""


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
def held_port() -> Iterator[int]:
    """A TCP port that the kernel gives to nobody else until the block ends, also while its server is stopped."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as holder:
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # Linux lets a server listen beside it
        holder.bind(("127.0.0.1", 0))
        port = int(holder.getsockname()[1])
        if sys.platform != "linux":
            holder.close()
        yield port


@contextmanager
def postgres_databases() -> Iterator[PostgresDatabases]:
    """A PostgreSQL of its own for the block."""
    folder = open_folder()
    with held_port() as port:
        server = PostgresServer(folder / "postgres", port, durable=False)
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
    with held_port() as port:
        server = NatsServer(folder / "nats", port)
        try:
            server.start()
            yield server
        finally:
            server.stop()
            shutil.rmtree(folder, ignore_errors=True)
