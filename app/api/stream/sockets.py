"""The websocket's path: who may open one, how many at once, and how each is ended."""

from __future__ import annotations

import asyncio
import socket as sockets
import sys
from typing import Final

import structlog
from aiohttp import WSCloseCode, web

from app.api.authentication import SUBPROTOCOL, authenticate_socket
from app.api.boundary import Boundary
from app.api.handshake import require_handshake
from app.api.metrics import Metrics
from app.api.problems import ApiError
from app.api.request_log import note_principal
from app.api.settings import ApiSettings
from app.api.stream.frames import CLOSE_REASONS, CloseCode
from app.api.stream.session import Session, Sources
from app.domain.errors import StorageError
from app.services.access import Access

MAX_INCOMING_BYTES: Final = 4096
log = structlog.get_logger(__name__)


class StreamEndpoint:
    """GET /api/v1/stream. Errors that a browser must tell apart come as close codes, for it sees no HTTP status."""

    def __init__(self, sources: Sources, access: Access, metrics: Metrics, settings: ApiSettings) -> None:
        self._sources = sources
        self._access = access
        self._metrics = metrics
        self._settings = settings
        self._sessions: set[Session] = set()
        self._opening = 0
        self._closing = False

    async def stream(self, request: web.Request) -> web.StreamResponse:
        """The handler."""
        self._refuse(request)
        socket = web.WebSocketResponse(
            heartbeat=self._settings.heartbeat_s,
            max_msg_size=MAX_INCOMING_BYTES,
            compress=False,
            protocols=(SUBPROTOCOL,),
            timeout=self._settings.close_grace_s,
            writer_limit=sys.maxsize,  # never wait inside aiohttp: see Session._wait_for_room
        )
        self._opening += 1
        self._metrics.sockets.inc()
        try:
            await socket.prepare(request)
            with Boundary(request) as boundary:
                code = await self._serve(request, socket)
            if boundary.problem is not None:
                code = CloseCode.DEFECT
            await self._end(request, socket, code)
        finally:
            self._opening -= 1
            self._metrics.sockets.dec()
        return socket

    async def close(self) -> None:
        """The service stops: end all sockets, and those that are just being opened as soon as they are."""
        self._closing = True
        for session in self._sessions:
            session.outbox.end(CloseCode.GOING_AWAY)

    def _refuse(self, request: web.Request) -> None:
        require_handshake(request, hint="open it as a websocket; GET /api/v1/events has the same events page by page")
        if self._opening >= self._settings.max_sockets:
            raise ApiError("stream.full", f"{self._opening} sockets are open, no more are taken")

    async def _serve(self, request: web.Request, socket: web.WebSocketResponse) -> CloseCode | None:
        try:
            note_principal(request, await authenticate_socket(request, self._access))
            after = _after(request)
        except ApiError:
            return CloseCode.UNAUTHORIZED
        except ValueError:
            return CloseCode.BAD_AFTER
        except StorageError:
            return CloseCode.TRY_AGAIN
        transport = request.transport
        if transport is None:
            return None
        _bound_kernel_buffer(transport, self._settings.socket_buffer_bytes)
        if self._closing:
            return CloseCode.GOING_AWAY
        session = Session(socket, transport, self._sources, self._settings)
        self._sessions.add(session)
        guard = asyncio.create_task(self._look_again(request, session), name="socket access")
        try:
            return await session.run(after)
        finally:
            self._sessions.discard(session)
            guard.cancel()
            await asyncio.gather(guard, return_exceptions=True)

    async def _look_again(self, request: web.Request, session: Session) -> None:
        """A token that is revoked while its socket is open ends the socket."""
        while True:
            await asyncio.sleep(self._settings.access_again_s)
            try:
                await authenticate_socket(request, self._access)
            except ApiError:
                session.outbox.end(CloseCode.UNAUTHORIZED)
                return
            except StorageError:
                log.warning("a socket's token cannot be looked at now")

    async def _end(self, request: web.Request, socket: web.WebSocketResponse, code: int | None) -> None:
        """Close with a code, and let go of the connection even if the client reads nothing."""
        transport = request.transport
        if code is not None:
            self._metrics.count_close(code)
            log.info("socket closed", code=int(code), client=request.remote)
        try:
            async with asyncio.timeout(self._settings.close_grace_s):
                reason = CLOSE_REASONS.get(code or 0, "").encode()
                await socket.close(code=code or WSCloseCode.OK, message=reason, drain=False)
        except (TimeoutError, ConnectionError):
            pass  # it does not read: the close frame waits behind what it did not take
        finally:
            if transport is not None and transport.get_write_buffer_size():
                transport.abort()


def _after(request: web.Request) -> int | None:
    """The query's `after`. Raises ValueError unless it is a whole number of 0 or more, given once."""
    given = request.query.getall("after", [])
    if not given:
        return None
    if len(given) > 1 or not given[0].isascii() or not given[0].isdigit() or len(given[0]) > 16:
        raise ValueError("after")
    return int(given[0])


def _bound_kernel_buffer(transport: asyncio.Transport, size_bytes: int) -> None:
    """Left alone, the kernel takes megabytes for a client that reads nothing, and it looks well for as long."""
    raw = transport.get_extra_info("socket")
    if raw is not None:
        raw.setsockopt(sockets.SOL_SOCKET, sockets.SO_SNDBUF, size_bytes)
