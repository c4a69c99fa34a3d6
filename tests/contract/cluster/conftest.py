"""NATS and PostgreSQL for this folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.cluster_servers import PostgresDatabases, nats_server, postgres_databases
from tools.cluster_servers import NatsServer


@pytest.fixture(scope="package")
def databases() -> Iterator[PostgresDatabases]:
    """A PostgreSQL server."""
    with postgres_databases() as server:
        yield server


@pytest.fixture
def nats() -> Iterator[NatsServer]:
    """A NATS server with an empty store."""
    with nats_server() as server:
        yield server
