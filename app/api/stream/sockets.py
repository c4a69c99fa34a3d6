"""The event stream's path: who may open one, and from where it is served."""

from __future__ import annotations

import sys
from typing import Final

from aiohttp import web

from app.api.handshake import require_handshake
from app.api.metrics import Metrics
from app.api.settings import ApiSettings
from app.api.socket_door import CloseCodes, SocketDoor
from app.api.stream.frames import CLOSE_REASONS, CloseCode
from app.api.stream.session import Session, Sources
from app.api.write_room import bound_kernel_buffer
from app.services.access import Access, Role

_CODES: Final = CloseCodes(
    going_away=CloseCode.GOING_AWAY,
    unauthorized=CloseCode.UNAUTHORIZED,
    role=CloseCode.UNAUTHORIZED,  # never told: every token may watch
    try_again=CloseCode.TRY_AGAIN,
    defect=CloseCode.DEFECT,
    reasons=CLOSE_REASONS,
)


class StreamEndpoint:
    """GET /api/v1/stream. Errors that a browser must tell apart come as close codes, for it sees no HTTP status."""

    def __init__(self, sources: Sources, access: Access, metrics: Metrics, settings: ApiSettings) -> None:
        self._sources = sources
        self._settings = settings
        self._door = SocketDoor("socket", _CODES, access, metrics, settings, max_sockets=settings.max_sockets)
        self.close = self._door.close

    async def stream(self, request: web.Request) -> web.StreamResponse:
        """The handler."""
        require_handshake(request, hint="open it as a websocket; GET /api/v1/events has the same events page by page")
        return await self._door.open(
            request,
            lambda socket, _: self._serve(request, socket),
            role=Role.VIEWER,
            heartbeat_s=self._settings.heartbeat_s,
            writer_limit=sys.maxsize,  # never wait inside aiohttp: see write_room
        )

    async def _serve(self, request: web.Request, socket: web.WebSocketResponse) -> CloseCode | None:
        try:
            after = _after(request)
        except ValueError:
            return CloseCode.BAD_AFTER
        transport = request.transport
        if transport is None:
            return None
        bound_kernel_buffer(transport, self._settings.socket_buffer_bytes)
        session = Session(socket, transport, self._sources, self._settings)
        return await self._door.attend(request, session.outbox, lambda: session.run(after))


def _after(request: web.Request) -> int | None:
    """The query's `after`. Raises ValueError unless it is a whole number of 0 or more, given once."""
    given = request.query.getall("after", [])
    if not given:
        return None
    if len(given) > 1 or not given[0].isascii() or not given[0].isdigit() or len(given[0]) > 16:
        raise ValueError("after")
    return int(given[0])
