"""Serves the application on one address, and reports a clear error if it cannot."""

from __future__ import annotations

import asyncio
import errno
import secrets
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Final

import structlog
from aiohttp import web

from app.api.guard import set_security_headers
from app.api.problems import ApiError, http_problem, internal_problem, problem_response
from app.domain.errors import WaydropError

# Answers requests that aiohttp cannot parse, which never reach the application.
#
# aiohttp would log their traceback, including header values, and respond in plain text with its version.


log = structlog.get_logger(__name__)


class RequestProtocol(web.RequestHandler):
    """aiohttp's connection protocol with a different response to malformed requests."""

    __slots__ = ()

    def handle_error(
        self,
        request: web.BaseRequest,
        status: int = 500,
        exc: BaseException | None = None,
        message: str | None = None,
    ) -> web.StreamResponse:
        """Respond with a problem. `exc` and `message` may quote the request, so they are neither sent nor logged."""
        if request.writer.output_size > 0:
            raise ConnectionError("the response has already started")
        identity = secrets.token_hex(8)
        if status == web.HTTPBadRequest.status_code:
            log.debug("malformed request", id=identity, client=request.remote, error=type(exc).__name__)
            answer = http_problem(web.HTTPBadRequest(), request_id=identity)
        else:
            log.error("defect", incident=identity, exc_info=exc)
            answer = internal_problem(request_id=identity)
        set_security_headers(answer)
        answer.force_close()
        return answer


# Limits connections before any byte is parsed: their number, and the time without a complete request head.
# nothing.
#
# A connection without a complete request head holds only a slot. A new connection replaces the oldest such one, so
# clients that send partial requests displace each other, and never a client that sends a complete request.


HEAD_END: Final = b"\r\n\r\n"
TOLD_EVERY_S: Final = 10.0
"""Interval of the log line that reports rejected connections, instead of one line each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionLimits:
    """At most `most` connections, and `most_per_address` from one address, websockets included.

    `head_s`: time limit for the first request head; `idle_s`: time limit between requests."""

    most: int = 1000
    most_per_address: int = 500
    head_s: float = 10.0
    idle_s: float = 75.0


class Connections:
    """Creates the protocol of each connection and tracks the open ones."""

    def __init__(self, make: Callable[[], asyncio.Protocol], limits: ConnectionLimits) -> None:
        self._make = make
        self._limits = limits
        self._by_address: Counter[str] = Counter()
        self._headless: dict[_Connection, None] = {}
        self._turned_away = 0
        self._told_s = -TOLD_EVERY_S

    def __call__(self) -> asyncio.Protocol:
        """Create the protocol of a new connection."""
        return _Connection(self, self._make())

    def admit(self, connection: _Connection) -> bool:
        """Whether to accept a connection. At the limit, one without a complete head is closed to make room."""
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
        """The connection has sent a complete request head."""
        self._headless.pop(connection, None)

    def forget(self, connection: _Connection) -> None:
        """The connection was closed."""
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
            log.warning("connections rejected", count=self._turned_away, last=address, open=open_now)
            self._turned_away, self._told_s = 0, now_s


class _Connection(asyncio.Protocol):
    """Forwards everything to aiohttp's protocol, and detects the end of the first request head."""

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
        """Close the connection unless its head has arrived by then."""
        self._timer = asyncio.get_running_loop().call_later(head_s, self.cut)

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
        self._handed_on = self._admitted
        if self._handed_on:
            self._inner.connection_made(transport)
        else:
            transport.write(_no_place())
            transport.close()

    def data_received(self, data: bytes) -> None:
        """Forward."""
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
        """Forward."""
        return self._inner.eof_received() if self._admitted else None

    def connection_lost(self, exc: Exception | None) -> None:
        """Forward, and free the slot."""
        self._leave()
        if self._handed_on:
            self._inner.connection_lost(exc)

    def pause_writing(self) -> None:
        """Forward."""
        if self._handed_on:
            self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Forward."""
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
    """A response sent before any request. The client learns the reason, then the connection is closed."""
    error = ApiError("connection.limit_reached", "too many open connections", hint="close unused connections")
    answer = problem_response(error, request_id=secrets.token_hex(8))
    body = answer.body if isinstance(answer.body, bytes) else b""
    head = [f"HTTP/1.1 {answer.status} Service Unavailable", "Connection: close", f"Content-Length: {len(body)}"]
    head += [f"{name}: {value}" for name, value in answer.headers.items() if name != "Content-Length"]
    return "\r\n".join((*head, "", "")).encode() + body


SHUTDOWN_S: Final = 1.0
"""Time limit for requests in progress at shutdown."""

BACKLOG: Final = 128
"""Length of the kernel's accept queue."""


class ListenError(WaydropError):
    """The service cannot listen on the address."""

    code = "listen.failed"


@asynccontextmanager
async def serving(
    app: web.Application, host: str, port: int, limits: ConnectionLimits | None = None
) -> AsyncIterator[str]:
    """Serve until the block ends. Yields the base URL.

    Raises:
        ListenError: the port is in use, or the host is not an address of this machine."""
    limits = limits or ConnectionLimits()
    runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=SHUTDOWN_S)
    await runner.setup()
    try:
        async with _listening(Connections(_protocols(runner, limits), limits), host, port) as bound_port:
            shown = f"[{host}]" if ":" in host else host
            yield f"http://{shown}:{bound_port}"
    finally:
        await runner.cleanup()


def _protocols(runner: web.AppRunner, limits: ConnectionLimits) -> Callable[[], asyncio.Protocol]:
    server, loop = runner.server, asyncio.get_running_loop()
    if server is None:
        raise AssertionError("the runner is not set up")
    options: dict[str, Any] = {
        "keepalive_timeout": limits.idle_s,
        "access_log": None,
    }  # None: the application logs requests itself
    return lambda: RequestProtocol(server, loop=loop, **options)


@asynccontextmanager
async def _listening(connections: Connections, host: str, port: int) -> AsyncIterator[int]:
    """Accept connections until the block ends. Yields the port."""
    loop = asyncio.get_running_loop()
    try:
        server = await loop.create_server(connections, host, port, backlog=BACKLOG)
    except OSError as error:
        raise _in_words(error, host, port) from error
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()


def _in_words(error: OSError, host: str, port: int) -> ListenError:
    if error.errno == errno.EADDRINUSE:
        return ListenError(
            f"port {port} on {host} is already in use",
            hint="stop the program that uses it (another Waydrop?), or choose another port with --port or WAYDROP_PORT",
        )
    if error.errno == errno.EACCES:
        return ListenError(f"permission denied to listen on port {port}", hint="choose a port above 1023")
    return ListenError(f"cannot listen on {host}:{port}: {error.strerror or error}", hint="choose another host")
