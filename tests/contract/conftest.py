"""PostgreSQL for the suites of the stores and of the cluster: a new one takes longer than most of their tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.cluster_servers import PostgresDatabases, postgres_databases


@pytest.fixture(scope="session")
def databases() -> Iterator[PostgresDatabases]:
    """A PostgreSQL server."""
    with postgres_databases() as server:
        yield server
