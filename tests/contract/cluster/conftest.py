"""NATS for this folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.cluster_servers import nats_server
from tools.cluster_servers import NatsServer


@pytest.fixture
def nats() -> Iterator[NatsServer]:
    """A NATS server with an empty store."""
    with nats_server() as server:
        yield server
