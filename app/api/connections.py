"""Limits connections before any byte is parsed: their number, and the time in which a client sends or reads nothing.

A connection holds only a slot while no request of it is handled: its request head is incomplete, or its response was
sent. A new connection replaces the oldest idle one. Clients that send partial requests or keep connections open
displace each other, and never a client that sends a complete request.
"""

from __future__ import annotations

import asyncio
import secrets
import socket
import ssl
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

import structlog

from app.api.problems import ApiError, problem_response
from app.api.proxies import Network, TrustedProxies
from app.api.tls import Certificate

log = structlog.get_logger(__name__)

HEAD_END: Final = b"\r\n\r\n"
TCP_USER_TIMEOUT: Final[int | None] = getattr(socket, "TCP_USER_TIMEOUT", None)
"""Linux only. Elsewhere only websockets have a time limit for a client that does not read."""

LOG_EVERY_S: Final = 10.0
"""Interval of the log line that reports rejected connections, instead of one line each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionLimits:
    """At most `most` connections, and `most_per_address` from one address, websockets included.

    `head_s`: time limit for the first request head; `idle_s`: time limit between requests; `stall_s`: time limit for a
    client that reads nothing of what is sent to it. All clients of a proxy have its address, so the limit per address
    does not hold for `proxies`.
    """

    most: int = 1000
    most_per_address: int = 500
    head_s: float = 10.0
    idle_s: float = 75.0
    stall_s: float = 30.0
    proxies: tuple[Network, ...] = ()


class ResponseReporter(Protocol):
    """An asyncio.Protocol of HTTP that calls `on_response` after each response."""

    on_response: Callable[[], None]

    def connection_made(self, transport: asyncio.BaseTransport) -> None: ...
    def data_received(self, data: bytes) -> None: ...
    def eof_received(self) -> None: ...
    def connection_lost(self, exc: Exception | None) -> None: ...
    def pause_writing(self) -> None: ...
    def resume_writing(self) -> None: ...


class Connections:
    """Creates the protocol of each connection and tracks the open ones."""

    def __init__(
        self, make: Callable[[], ResponseReporter], limits: ConnectionLimits, tls: Certificate | None = None
    ) -> None:
        self._make = make
        self._tls = tls
        self._limits = limits
        self._proxies = TrustedProxies(limits.proxies)
        self._by_address: Counter[str] = Counter()
        self._idle: dict[_Connection, None] = {}
        self._turned_away = 0
        self._logged_s = -LOG_EVERY_S

    def __call__(self) -> asyncio.Protocol:
        """Create the protocol of a new connection."""
        if self._tls is None:
            return _Connection(self, self._make())
        return _TlsConnection(self, self._make(), self._tls.context)

    def admit(self, connection: _Connection) -> bool:
        """Whether to accept a connection. At the limit, an idle one is closed to make room."""
        address = connection.address
        is_full = self._by_address[address] >= self._limits.most_per_address and not self._proxies.contains(address)
        if is_full and not self._make_room(address):
            return self._refuse(address)
        if self._by_address.total() >= self._limits.most and not self._make_room(None):
            return self._refuse(address)
        self._by_address[address] += 1
        self._idle[connection] = None
        connection.expire_in(self._limits.head_s)
        connection.limit_stall(self._limits.stall_s)
        return True

    def has_head(self, connection: _Connection) -> None:
        """The connection has sent a complete request head."""
        self._idle.pop(connection, None)

    def has_response(self, connection: _Connection) -> None:
        """The response was sent: the connection waits for the next request."""
        self._idle[connection] = None

    def forget(self, connection: _Connection) -> None:
        """The connection was closed."""
        self._idle.pop(connection, None)
        self._by_address[connection.address] -= 1
        if not self._by_address[connection.address]:
            del self._by_address[connection.address]

    def _make_room(self, address: str | None) -> bool:
        oldest = next((one for one in self._idle if address in (None, one.address)), None)
        if oldest is None:
            return False
        oldest.cut()
        self._log(oldest.address)
        return True

    def _refuse(self, address: str) -> bool:
        self._log(address)
        return False

    def _log(self, address: str) -> None:
        self._turned_away += 1
        now_s = time.monotonic()
        if now_s - self._logged_s >= LOG_EVERY_S:
            open_now = self._by_address.total()
            log.warning("connections rejected", count=self._turned_away, last=address, open=open_now)
            self._turned_away, self._logged_s = 0, now_s


class _Connection(asyncio.Protocol):
    """Forwards everything to aiohttp's protocol, and detects the end of a request head."""

    def __init__(self, connections: Connections, inner: ResponseReporter) -> None:
        self.address = ""
        self._connections = connections
        self._inner = inner
        self._inner.on_response = self._on_response
        self._transport: asyncio.Transport | None = None
        self._admitted = False
        self._handed_on = False
        self._tail: bytes | None = b""
        self._timer: asyncio.TimerHandle | None = None

    def expire_in(self, head_s: float) -> None:
        """Close the connection unless its head has arrived by then."""
        self._timer = asyncio.get_running_loop().call_later(head_s, self.cut)

    def limit_stall(self, stall_s: float) -> None:
        """Let the kernel close the connection when the client reads nothing for so long, even during a file."""
        raw = None if self._transport is None else self._transport.get_extra_info("socket")
        if raw is not None and TCP_USER_TIMEOUT is not None:
            raw.setsockopt(socket.IPPROTO_TCP, TCP_USER_TIMEOUT, round(stall_s * 1000))

    def cut(self) -> None:
        """Close at once and free the slot."""
        self._leave()
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Accept the connection, or respond that the limit is reached."""
        if not isinstance(transport, asyncio.Transport):
            raise TypeError("a stream transport is required")
        self._transport = transport
        peer = transport.get_extra_info("peername")
        self.address = str(peer[0]) if peer else ""
        self._admitted = self._connections.admit(self)
        if self._admitted:
            self._begin(transport)
        else:
            self._reject(transport)

    def data_received(self, data: bytes) -> None:
        if not self._admitted:
            return
        if self._tail is not None:
            seen = self._tail + data
            self._tail = None if HEAD_END in seen else seen[1 - len(HEAD_END) :]
            if self._tail is None:
                self._stop_timer()
                self._connections.has_head(self)
        self._inner.data_received(data)

    def eof_received(self) -> None:
        if self._admitted:
            self._inner.eof_received()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forward, and free the slot."""
        self._leave()
        if self._handed_on:
            self._inner.connection_lost(exc)

    def pause_writing(self) -> None:
        if self._handed_on:
            self._inner.pause_writing()

    def resume_writing(self) -> None:
        if self._handed_on:
            self._inner.resume_writing()

    def _begin(self, transport: asyncio.Transport) -> None:
        self._handed_on = True
        self._inner.connection_made(transport)

    def _reject(self, transport: asyncio.Transport) -> None:
        transport.write(_no_place())
        transport.close()

    def _on_response(self) -> None:
        if self._admitted:
            self._tail = b""
            self._connections.has_response(self)

    def _leave(self) -> None:
        self._stop_timer()
        if self._admitted:
            self._admitted = False
            self._connections.forget(self)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class _TlsConnection(_Connection):
    """The same over TLS. A connection counts from its first packet, so that handshakes are limited too.

    asyncio's own TLS server calls its protocol only after the handshake: connections without one would be unlimited.
    """

    def __init__(self, connections: Connections, inner: ResponseReporter, context: ssl.SSLContext) -> None:
        super().__init__(connections, inner)
        self._context = context
        self._handshake: asyncio.Task[None] | None = None
        self._early: list[bytes] = []

    def data_received(self, data: bytes) -> None:
        """Forward. What comes with the end of the handshake waits until the inner protocol is connected."""
        if self._handed_on:
            super().data_received(data)
        else:
            self._early.append(data)

    def eof_received(self) -> None:
        if self._handed_on:
            super().eof_received()
        else:
            self.cut()

    def _begin(self, transport: asyncio.Transport) -> None:
        transport.pause_reading()  # the first bytes are the handshake's
        self._handshake = asyncio.create_task(self._shake_hands(transport), name="tls handshake")

    def _reject(self, transport: asyncio.Transport) -> None:
        transport.abort()

    async def _shake_hands(self, transport: asyncio.Transport) -> None:
        loop = asyncio.get_running_loop()
        try:
            encrypted = await loop.start_tls(transport, self, self._context, server_side=True)
        except OSError:  # ssl.SSLError is one: not TLS, no common version, or gone
            self._leave()
            return
        if encrypted is None or not self._admitted:  # gone with the end of the handshake
            transport.abort()
            return
        self._transport = encrypted
        super()._begin(encrypted)
        early, self._early = self._early, []
        for data in early:
            super().data_received(data)


def _no_place() -> bytes:
    """A response sent before any request. The client learns the reason, then the connection is closed."""
    error = ApiError("connection.limit_reached", "too many open connections", hint="close unused connections")
    answer = problem_response(error, request_id=secrets.token_hex(8))
    body = answer.body if isinstance(answer.body, bytes) else b""
    head = [f"HTTP/1.1 {answer.status} Service Unavailable", "Connection: close", f"Content-Length: {len(body)}"]
    head += [f"{name}: {value}" for name, value in answer.headers.items() if name != "Content-Length"]
    return "\r\n".join((*head, "", "")).encode() + body
