"""TCP: a port that vehicles connect to (tcpin), and one of a vehicle that Waydrop connects to (tcpout)."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import time
from collections import Counter
from collections.abc import Iterable
from typing import Final, cast

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.datagrams import TURN_S, Address
from app.vehicles.link_guard.options import ConnectionOptions
from app.vehicles.link_guard.policy import Peer
from app.vehicles.link_guard.rate_budget import RateBudget, RateBudgets
from app.vehicles.link_guard.streams import Backlog, ByteStream, StallWatch
from app.vehicles.link_guard.transport import FrameReceiver
from app.vehicles.link_guard.udp import family_of, place_name

AGAIN_S: Final = 1.0
"""A connection that was lost is tried again so often."""
_WAITING_S: Final = 1.0
"""While the oldest byte has not been acknowledged for so long nothing is sent: a round trip may take that long."""
_CUT_S: Final = 5.0
"""A connection that acknowledges nothing for so long is cut, with all that it would still deliver."""
_UNKNOWN_S: Final = 5.0
"""A connection from which no vehicle is heard is cut after so long without a frame: a HEARTBEAT comes each second."""
_MOST_UNKNOWN: Final = 32
"""Connections from which no vehicle is heard yet. The number of all others is bounded by that of the systems."""
_ACCEPTS_PER_S: Final = 200.0
_REST_S: Final = 0.05
_BACKLOG: Final = 1024
"""Of connections that wait to be accepted: who is not allowed must not fill it."""
_NO_LINGER: Final = struct.pack("ii", 1, 0)


class _Connection(asyncio.Protocol):
    """One connection, and the peer at its end."""

    def __init__(self, place: Address, receiver: FrameReceiver, watch: StallWatch, budgets: RateBudgets) -> None:
        self._receiver = receiver
        self._watch = watch
        self._budgets = budgets
        self._transport: asyncio.Transport | None = None
        self._backlog: Backlog | None = None
        self._stream: ByteStream | None = None
        self.peer = Peer(place[0], place_name(place), is_allowed=True)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        sock: socket.socket = transport.get_extra_info("socket")
        with contextlib.suppress(OSError, AttributeError):  # not every system has them
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(_CUT_S * 1e3))
        self._backlog = Backlog(sock.fileno())
        self._stream = ByteStream(self.peer, self._receiver, self._watch, self._transport, self._budgets)

    def data_received(self, data: bytes) -> None:
        if self._stream is not None:
            self._stream.feed(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None
        if self._stream is not None:
            self._stream.close()
        self._receiver.lost(self.peer)

    @property
    def is_open(self) -> bool:
        """Whether frames can be sent."""
        return self._transport is not None

    @property
    def is_unknown(self) -> bool:
        """Whether no vehicle is heard from it yet."""
        return self._stream is not None and not self._stream.is_of_vehicle

    def tick(self) -> None:
        """Count the vehicles that are heard from it."""
        if self._stream is not None:
            self._stream.tick()

    def is_silent(self, now_s: float) -> bool:
        """Whether it had its time to say something, and did not."""
        return self.is_unknown and self._stream is not None and now_s - self._stream.heard_s > _UNKNOWN_S

    def send(self, frame: bytes) -> bool:
        transport, now_s = self._transport, time.monotonic()
        if transport is None or self._backlog is None:
            return True  # lost meanwhile: as good as lost on the way
        if transport.get_write_buffer_size() or self._backlog.age_s(now_s) > _WAITING_S:
            return False
        transport.write(frame)
        self._backlog.wrote(len(frame), now_s)
        return True

    def refuse(self) -> None:
        """End it, because it shows no vehicle."""
        self._receiver.refuse(RefusalKind.NOT_ANNOUNCED, self.peer)
        self.cut()

    def cut(self) -> None:
        """End it now, without what waits."""
        if self._stream is not None:
            self._stream.close()
        if self._transport is not None:
            sock: socket.socket = self._transport.get_extra_info("socket")
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_LINGER)
            self._transport.abort()


class TcpListener:
    """tcpin, a LinkTransport."""

    def __init__(self, host: str, port: int, options: ConnectionOptions, receiver: FrameReceiver) -> None:
        self._place = (host, port)
        self._options = options
        self._receiver = receiver
        self._connections: list[_Connection] = []
        """Oldest first."""
        self._accepts = RateBudget(_ACCEPTS_PER_S, burst_s=0.2)
        self._budgets = RateBudgets()
        self._sock: socket.socket | None = None
        self._watch: StallWatch | None = None
        self._pause: asyncio.TimerHandle | None = None
        self._opening: set[asyncio.Task[object]] = set()

    async def open(self) -> None:
        self._sock = socket.create_server(self._place, family=family_of(self._place[0]), backlog=_BACKLOG)
        self._sock.setblocking(False)
        self._watch = StallWatch()
        asyncio.get_running_loop().add_reader(self._sock, self._accept)

    def send(self, peer: Peer, frame: bytes) -> bool:
        to = next((connection for connection in self._connections if connection.peer is peer), None)
        return True if to is None else to.send(frame)

    def awaiting_heartbeat(self) -> Iterable[Peer]:
        return tuple([one.peer for one in self._connections])

    def tick(self, now_s: float) -> None:
        self._connections = [connection for connection in self._connections if connection.is_open]
        for connection in self._connections:
            connection.tick()
            if connection.is_silent(now_s):
                connection.refuse()

    def close(self) -> None:
        if self._pause is not None:
            self._pause.cancel()
        for opening in self._opening:
            opening.cancel()
        if self._sock is not None:
            asyncio.get_running_loop().remove_reader(self._sock)
            self._sock.close()
            self._sock = None
        for connection in self._connections:
            connection.cut()
        if self._watch is not None:
            self._watch.close()

    def _accept(self) -> None:
        """Take one connection: so many a second, for each costs time whoever makes it."""
        assert self._sock is not None
        assert self._watch is not None
        until_s = time.monotonic() + TURN_S
        while time.monotonic() < until_s:
            try:
                sock, place = self._sock.accept()
            except BlockingIOError:
                return
            except OSError:  # it is gone again, or the process has no file left
                self._rest(_REST_S)
                return
            if self._options.allows(place[0]):
                self._make_room()
                connection = _Connection(place, self._receiver, self._watch, self._budgets)
                opening = asyncio.create_task(self._open(connection, sock), name=f"tcpin {place_name(place)}")
                self._opening.add(opening)
                opening.add_done_callback(self._opening.discard)
                self._rest(self._accepts.spend(1, time.monotonic()))
                return
            self._receiver.refuse(RefusalKind.PEER_NOT_ALLOWED, Peer(place[0], place_name(place), is_allowed=False))
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_LINGER)
            sock.close()

    async def _open(self, connection: _Connection, sock: socket.socket) -> None:
        with contextlib.suppress(OSError):  # it is gone again
            await asyncio.get_running_loop().connect_accepted_socket(lambda: connection, sock)
            self._connections.append(connection)

    def _rest(self, seconds: float) -> None:
        """Take no connection for so long."""
        if not seconds or self._sock is None:
            return
        loop, sock = asyncio.get_running_loop(), self._sock
        loop.remove_reader(sock)
        self._pause = loop.call_later(seconds, loop.add_reader, sock, self._accept)

    def _make_room(self) -> None:
        """Of too many unknown peers the oldest goes, from the address that has most: a vehicle has one or a few."""
        unknown = [one for one in self._connections if one.is_open and one.is_unknown]
        if len(unknown) + len(self._opening) < _MOST_UNKNOWN:
            return
        for address, _ in Counter(one.peer.address for one in unknown).most_common(1):
            next(one for one in unknown if one.peer.address == address).refuse()


class TcpClient:
    """tcpout, a LinkTransport: connects again and again."""

    def __init__(self, host: str, port: int, receiver: FrameReceiver) -> None:
        self._place = (host, port)
        self._receiver = receiver
        self._budgets = RateBudgets()
        self._connection: _Connection | None = None
        self._task: asyncio.Task[None] | None = None
        self._watch: StallWatch | None = None

    async def open(self) -> None:
        """See LinkTransport. The other end may not be there yet."""
        self._watch = StallWatch()
        self._task = asyncio.create_task(self._stay_connected(self._watch), name=f"tcpout {self._place}")

    def send(self, peer: Peer, frame: bytes) -> bool:
        connection = self._connection
        return True if connection is None or connection.peer is not peer else connection.send(frame)

    def awaiting_heartbeat(self) -> Iterable[Peer]:
        connection = self._connection
        return () if connection is None else (connection.peer,)

    def tick(self, now_s: float) -> None:
        if self._connection is not None:
            self._connection.tick()

    def close(self) -> None:
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
                        lambda: _Connection(self._place, self._receiver, watch, self._budgets), *self._place
                    )
            await asyncio.sleep(AGAIN_S)
