"""The path of a target's reports as a websocket: who may open one, and what it serves."""

from __future__ import annotations

import sys
from typing import Final

from aiohttp import web

from app.api.handshake import require_handshake
from app.api.metrics import Metrics
from app.api.settings import ApiSettings
from app.api.socket_door import CloseCodes, SocketDoor
from app.api.target_reports.frames import REPORTS_CLOSE_REASONS, ReportsCloseCode
from app.api.target_reports.session import ReportsSession
from app.api.targets import require_feed
from app.api.write_room import bound_kernel_buffer
from app.services.access import Access, Role
from app.services.targets import Targets

_CODES: Final = CloseCodes(
    going_away=ReportsCloseCode.GOING_AWAY,
    unauthorized=ReportsCloseCode.UNAUTHORIZED,
    role=ReportsCloseCode.ROLE,
    try_again=ReportsCloseCode.TRY_AGAIN,
    defect=ReportsCloseCode.DEFECT,
    reasons=REPORTS_CLOSE_REASONS,
)


class ReportsEndpoint:
    """GET /api/v1/targets/{feed}/reports. A target outlives its socket: its last report stays known, and grows old."""

    def __init__(self, targets: Targets, access: Access, metrics: Metrics, settings: ApiSettings) -> None:
        self._targets = targets
        self._settings = settings
        self._door = SocketDoor("reports socket", _CODES, access, metrics, settings, max_sockets=settings.max_sockets)
        self.close = self._door.close

    async def report(self, request: web.Request) -> web.StreamResponse:
        """The handler."""
        require_handshake(request, hint="open it as a websocket; single reports go by POST to the path above it")
        feed = require_feed(request.match_info["feed"])
        return await self._door.open(
            request,
            lambda socket, _: self._serve(request, socket, feed),
            role=Role.DISPATCHER,
            heartbeat_s=self._settings.heartbeat_s,
            writer_limit=sys.maxsize,  # never wait inside aiohttp: see write_room
        )

    async def _serve(self, request: web.Request, socket: web.WebSocketResponse, feed: str) -> ReportsCloseCode | None:
        transport = request.transport
        if transport is None:
            return None
        bound_kernel_buffer(transport, self._settings.socket_buffer_bytes)
        session = ReportsSession(socket, transport, self._targets, feed, self._settings.send_timeout_s)
        return await self._door.attend(request, session, session.run)
