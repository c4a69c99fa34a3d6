"""Connections are bounded before anything of them is understood: how many there are, and how long they may say nothing.

A connection that has not sent a whole request head holds nothing but a place. So it gives way to a newcomer, the
oldest first: whoever sends half requests shuts out those who do the same, and nobody who asks at once.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import structlog

from app.api.problems import ApiError, problem_response

HEAD_END: Final = b"\r\n\r\n"
TOLD_EVERY_S: Final = 10.0
"""How often the log says that connections were turned away: not once for each."""

log = structlog.get_logger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionLimits:
    """At most `most` connections, `most_per_address` of them from one address; websockets count too.

    `head_s`: how long the head of the first request may take; `idle_s`: how long until the next one is there.
    """

    most: int = 1000
    most_per_address: int = 500
    head_s: float = 10.0
    idle_s: float = 75.0


class Connections:
    """Makes the protocol of each new connection, and knows all that are open."""

    def __init__(self, make: Callable[[], asyncio.Protocol], limits: ConnectionLimits) -> None:
        self._make = make
        self._limits = limits
        self._by_address: Counter[str] = Counter()
        self._headless: dict[_Connection, None] = {}
        self._turned_away = 0
        self._told_s = -TOLD_EVERY_S

    def __call__(self) -> asyncio.Protocol:
        """The protocol of a new connection."""
        return _Connection(self, self._make())

    def admit(self, connection: _Connection) -> bool:
        """Whether it is taken. A headless one is let go for it if the places are all taken."""
        address = connection.address
        if self._by_address[address] >= self._limits.most_per_address and not self._make_room(address):
            return self._refuse(address)
        if self._by_address.total() >= self._limits.most and not self._make_room(None):
            return self._refuse(address)
        self._by_address[address] += 1
        self._headless[connection] = None
        connection.expire_in(self._limits.head_s)
        return True

    def has_head(self, connection: _Connection) -> None:
        """It has sent a whole head."""
        self._headless.pop(connection, None)

    def forget(self, connection: _Connection) -> None:
        """It is closed, or cut."""
        self._headless.pop(connection, None)
        self._by_address[connection.address] -= 1
        if not self._by_address[connection.address]:
            del self._by_address[connection.address]

    def _make_room(self, address: str | None) -> bool:
        oldest = next((one for one in self._headless if address in (None, one.address)), None)
        if oldest is None:
            return False
        oldest.cut()
        self._tell(oldest.address)
        return True

    def _refuse(self, address: str) -> bool:
        self._tell(address)
        return False

    def _tell(self, address: str) -> None:
        self._turned_away += 1
        now_s = time.monotonic()
        if now_s - self._told_s >= TOLD_EVERY_S:
            open_now = self._by_address.total()
            log.warning("connections turned away", count=self._turned_away, last=address, open=open_now)
            self._turned_away, self._told_s = 0, now_s


class _Connection(asyncio.Protocol):
    """Hands everything on to aiohttp's protocol; watches for the end of the first head meanwhile."""

    def __init__(self, connections: Connections, inner: asyncio.Protocol) -> None:
        self.address = ""
        self._connections = connections
        self._inner = inner
        self._transport: asyncio.Transport | None = None
        self._admitted = False
        self._handed_on = False
        self._tail: bytes | None = b""
        self._timer: asyncio.TimerHandle | None = None

    def expire_in(self, head_s: float) -> None:
        """Cut it unless it has a head by then."""
        self._timer = asyncio.get_running_loop().call_later(head_s, self.cut)

    def cut(self) -> None:
        """Let go at once; its place is free."""
        self._leave()
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take it, or say that there is no place."""
        if not isinstance(transport, asyncio.Transport):
            raise TypeError("a stream is needed")
        self._transport = transport
        peer = transport.get_extra_info("peername")
        self.address = str(peer[0]) if peer else ""
        self._admitted = self._connections.admit(self)
        self._handed_on = self._admitted
        if self._handed_on:
            self._inner.connection_made(transport)
        else:
            transport.write(_no_place())
            transport.close()

    def data_received(self, data: bytes) -> None:
        """Pass it on."""
        if not self._admitted:
            return
        if self._tail is not None:
            seen = self._tail + data
            self._tail = None if HEAD_END in seen else seen[1 - len(HEAD_END) :]
            if self._tail is None:
                self._stop_timer()
                self._connections.has_head(self)
        self._inner.data_received(data)

    def eof_received(self) -> bool | None:
        """Pass it on."""
        return self._inner.eof_received() if self._admitted else None

    def connection_lost(self, exc: Exception | None) -> None:
        """Pass it on; its place is free."""
        self._leave()
        if self._handed_on:
            self._inner.connection_lost(exc)

    def pause_writing(self) -> None:
        """Pass it on."""
        if self._handed_on:
            self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Pass it on."""
        if self._handed_on:
            self._inner.resume_writing()

    def _leave(self) -> None:
        self._stop_timer()
        if self._admitted:
            self._admitted = False
            self._connections.forget(self)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


def _no_place() -> bytes:
    """An answer before any question: who reads it learns why, and the connection is closed behind it."""
    error = ApiError("connections.full", "too many connections are open", hint="close what you do not need")
    answer = problem_response(error, request_id=secrets.token_hex(8))
    body = answer.body if isinstance(answer.body, bytes) else b""
    head = [f"HTTP/1.1 {answer.status} Service Unavailable", "Connection: close", f"Content-Length: {len(body)}"]
    head += [f"{name}: {value}" for name, value in answer.headers.items() if name != "Content-Length"]
    return "\r\n".join((*head, "", "")).encode() + body
