"""The port on which a connection's mavsdk listens is nobody else's."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from urllib.parse import urlsplit

import pytest

from app.vehicles.link_guard.guard import LOOPBACK, LinkGuard
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.options import parse_connection

OTHERS = 800
OPENED = 400
"""With SO_REUSEADDR set before bind, a dozen of them had the port of one of the others."""


@pytest.fixture
def ports_of_others() -> Iterator[set[int]]:
    """Of sockets as mavsdk's."""
    with ExitStack() as stack:
        ports = set()
        for _ in range(OTHERS):
            sock = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sock.bind((LOOPBACK, 0))
            ports.add(sock.getsockname()[1])
        yield ports


async def test_no_connection_is_given_a_port_that_another_mavsdk_has(ports_of_others: set[int]) -> None:
    for _ in range(OPENED):
        guard = LinkGuard(parse_connection("udpout://127.0.0.1:14550"), SigningStore(), 0)
        await guard.open()
        try:
            assert urlsplit(guard.inner_url).port not in ports_of_others
        finally:
            guard.close()
