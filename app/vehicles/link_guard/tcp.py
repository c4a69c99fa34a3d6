"""TCP: a port that vehicles connect to (tcpin), and one of a vehicle that Waydrop connects to (tcpout)."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import time
from collections.abc import Callable, Iterable
from typing import Final, cast

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.options import ConnectionOptions
from app.vehicles.link_guard.outside import Inward
from app.vehicles.link_guard.policy import Peer
from app.vehicles.link_guard.streams import Backlog, ByteStream, StallWatch

AGAIN_S: Final = 1.0
"""A connection that was lost is tried again so often."""
_WAITING_S: Final = 1.0
"""While the oldest byte has not been acknowledged for so long nothing is sent: a round trip may take that long."""
_CUT_S: Final = 5.0
"""A connection that acknowledges nothing for so long is cut, with all that it would still deliver."""
_MOST_CONNECTIONS: Final = 32
_NO_LINGER: Final = struct.pack("ii", 1, 0)


class _Connection(asyncio.Protocol):
    """One connection, and the peer at its end."""

    def __init__(self, inward: Inward, watch: StallWatch, allows: Callable[[_Connection, str], bool]) -> None:
        self._inward = inward
        self._watch = watch
        self._allows = allows
        self._transport: asyncio.Transport | None = None
        self._backlog: Backlog | None = None
        self._stream: ByteStream | None = None
        self.peer: Peer | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        host, port = transport.get_extra_info("peername")[:2]
        self.peer = Peer(host, f"[{host}]:{port}" if ":" in host else f"{host}:{port}", is_allowed=True)
        if not self._allows(self, host):
            self._inward.refuse(RefusalKind.PEER_NOT_ALLOWED, self.peer)
            self.cut()
            return
        sock: socket.socket = transport.get_extra_info("socket")
        with contextlib.suppress(OSError, AttributeError):  # not every system has them
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(_CUT_S * 1e3))
        self._backlog = Backlog(sock.fileno())
        self._stream = ByteStream(self.peer, self._inward, self._watch)

    def data_received(self, data: bytes) -> None:
        if self._stream is not None:
            self._stream.feed(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None
        if self.peer is not None:
            self._inward.lost(self.peer)

    @property
    def is_open(self) -> bool:
        """Whether frames can be sent."""
        return self._backlog is not None and self._transport is not None

    def send(self, frame: bytes) -> bool:
        """See Outside.send."""
        transport, now_s = self._transport, time.monotonic()
        if transport is None or self._backlog is None:
            return True  # lost meanwhile: as good as lost on the way
        if transport.get_write_buffer_size() or self._backlog.age_s(now_s) > _WAITING_S:
            return False
        transport.write(frame)
        self._backlog.wrote(len(frame), now_s)
        return True

    def cut(self) -> None:
        """End it now, without what waits."""
        if self._transport is not None:
            sock: socket.socket = self._transport.get_extra_info("socket")
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_LINGER)
            self._transport.abort()


class TcpListener:
    """tcpin."""

    def __init__(self, host: str, port: int, options: ConnectionOptions, inward: Inward) -> None:
        self._place = (host, port)
        self._options = options
        self._inward = inward
        self._connections: set[_Connection] = set()
        self._server: asyncio.Server | None = None
        self._watch: StallWatch | None = None

    async def open(self) -> None:
        """See Outside."""
        loop = asyncio.get_running_loop()
        watch = StallWatch()
        self._server = await loop.create_server(
            lambda: _Connection(self._inward, watch, self._takes), *self._place, reuse_address=True
        )
        self._watch = watch

    def send(self, peer: Peer, frame: bytes) -> bool:
        """See Outside."""
        to = next((connection for connection in self._connections if connection.peer is peer), None)
        return True if to is None else to.send(frame)

    def greeted(self) -> Iterable[Peer]:
        """See Outside."""
        return tuple([one.peer for one in self._connections if one.peer is not None])

    def tick(self, now_s: float) -> None:
        """See Outside."""
        self._connections = {connection for connection in self._connections if connection.is_open}

    def close(self) -> None:
        """See Outside."""
        if self._server is not None:
            self._server.close()
        for connection in self._connections:
            connection.cut()
        if self._watch is not None:
            self._watch.close()

    def _takes(self, connection: _Connection, address: str) -> bool:
        self.tick(0.0)
        if not self._options.allows(address) or len(self._connections) >= _MOST_CONNECTIONS:
            return False
        self._connections.add(connection)
        return True


class TcpClient:
    """tcpout: connects again and again."""

    def __init__(self, host: str, port: int, inward: Inward) -> None:
        self._place = (host, port)
        self._inward = inward
        self._connection: _Connection | None = None
        self._task: asyncio.Task[None] | None = None
        self._watch: StallWatch | None = None

    async def open(self) -> None:
        """See Outside. The other end may not be there yet."""
        self._watch = StallWatch()
        self._task = asyncio.create_task(self._stay_connected(self._watch), name=f"tcpout {self._place}")

    def send(self, peer: Peer, frame: bytes) -> bool:
        """See Outside."""
        connection = self._connection
        return True if connection is None or connection.peer is not peer else connection.send(frame)

    def greeted(self) -> Iterable[Peer]:
        """See Outside."""
        connection = self._connection
        return () if connection is None or connection.peer is None else (connection.peer,)

    def tick(self, now_s: float) -> None:
        """See Outside."""

    def close(self) -> None:
        """See Outside."""
        if self._task is not None:
            self._task.cancel()
        if self._connection is not None:
            self._connection.cut()
        if self._watch is not None:
            self._watch.close()

    async def _stay_connected(self, watch: StallWatch) -> None:
        loop = asyncio.get_running_loop()
        while True:
            if self._connection is None or not self._connection.is_open:
                with contextlib.suppress(OSError):
                    _, self._connection = await loop.create_connection(
                        lambda: _Connection(self._inward, watch, lambda connection, address: True), *self._place
                    )
            await asyncio.sleep(AGAIN_S)
