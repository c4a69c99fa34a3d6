"""The clients of bench.fanout: many websockets that only read, in a process of their own.

Says `ready` when all are connected, and `seen N` when all have got the last event of turn N.
"""

from __future__ import annotations

import asyncio
import re
import sys

HANDSHAKE = (
    "GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n"
)
LAST = re.compile(rb"last-of-turn-(\d+)\.")
TAIL_BYTES = 40


def last_marker(turn: int) -> str:
    """What stands in the last event of a turn."""
    return f"last-of-turn-{turn}."


class Clients:
    """Counts at how many clients something has come."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._connected = 0
        self._seen: dict[bytes, int] = {}

    def connected(self) -> None:
        """One more has completed its handshake."""
        self._connected += 1
        if self._connected == self._count:
            _print_line("ready")

    def seen(self, turn: bytes) -> None:
        """One more has the last event of a turn."""
        self._seen[turn] = self._seen.get(turn, 0) + 1
        if self._seen[turn] == self._count:
            _print_line(f"seen {turn.decode()}")


class Client(asyncio.Protocol):
    """One websocket; it looks for the marker in the bytes and takes nothing else apart."""

    def __init__(self, clients: Clients, path: str) -> None:
        self._clients = clients
        self._path = path
        self._tail = b""
        self._open = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Complete the handshake."""
        if isinstance(transport, asyncio.WriteTransport):
            transport.write(HANDSHAKE.format(path=self._path).encode())

    def data_received(self, data: bytes) -> None:
        """Look for the marker, also where two reads meet."""
        if not self._open and b"\r\n\r\n" in self._tail + data:
            self._open = True
            self._clients.connected()
        for turn in LAST.findall(self._tail + data):
            self._clients.seen(turn)
            data = b""
        self._tail = data[-TAIL_BYTES:]

    def connection_lost(self, exc: Exception | None) -> None:
        """A client that was cut makes the measurement worthless."""
        _print_line("cut")


def _print_line(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


async def run(port: int, path: str, count: int) -> None:
    """Connect all and read for ever."""
    clients = Clients(count)
    loop = asyncio.get_running_loop()
    for _ in range(count):
        await loop.create_connection(lambda: Client(clients, path), "127.0.0.1", port)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(run(int(sys.argv[1]), sys.argv[2], int(sys.argv[3])))
