"""The offboard websocket's path: who may open one, and how each is ended."""

from __future__ import annotations

import asyncio
from typing import Final

import structlog
from aiohttp import WSCloseCode, web

from app.api.authentication import SUBPROTOCOL, authenticate_socket, require_role
from app.api.boundary import Boundary
from app.api.by_hand.frames import CLOSE_REASONS, ByHandCloseCode
from app.api.by_hand.session import ByHandSession
from app.api.handshake import require_handshake
from app.api.metrics import Metrics
from app.api.problems import ApiError
from app.api.request_log import note_principal
from app.api.settings import ApiSettings
from app.domain.errors import NotFoundError, StorageError
from app.services.access import Access, Role
from app.services.offboard import Offboard

MAX_INCOMING_BYTES: Final = 4096
MAX_SOCKETS: Final = 64
HEARTBEAT_S: Final = 5.0
log = structlog.get_logger(__name__)


class ByHandEndpoint:
    """GET /api/v1/vehicles/{vehicle_id}/offboard as a websocket."""

    def __init__(self, offboard: Offboard, access: Access, metrics: Metrics, settings: ApiSettings) -> None:
        self._offboard = offboard
        self._access = access
        self._metrics = metrics
        self._settings = settings
        self._sessions: set[ByHandSession] = set()
        self._open = 0
        self._closing = False

    async def fly(self, request: web.Request) -> web.StreamResponse:
        """The handler."""
        require_handshake(request, hint="open it as a websocket; single setpoints go by POST .../offboard/setpoint")
        if self._open >= MAX_SOCKETS:
            raise ApiError("stream.full", f"{self._open} offboard sockets are open, no more are taken")
        socket = web.WebSocketResponse(
            heartbeat=HEARTBEAT_S,
            max_msg_size=MAX_INCOMING_BYTES,
            compress=False,
            protocols=(SUBPROTOCOL,),
            timeout=self._settings.close_grace_s,
        )
        self._open += 1
        self._metrics.sockets.inc()
        try:
            await socket.prepare(request)
            with Boundary(request) as boundary:
                code = await self._serve(request, socket)
            if boundary.problem is not None:
                code = ByHandCloseCode.DEFECT
            await self._end(request, socket, code)
        finally:
            self._open -= 1
            self._metrics.sockets.dec()
        return socket

    async def close(self) -> None:
        """The service stops: end all sockets, and those that are just being opened as soon as they are."""
        self._closing = True
        for session in self._sessions:
            session.end(ByHandCloseCode.GOING_AWAY)

    async def _serve(self, request: web.Request, socket: web.WebSocketResponse) -> ByHandCloseCode | None:
        try:
            principal = await authenticate_socket(request, self._access)
            note_principal(request, principal)
            require_role(principal, Role.PILOT)
            vehicle = self._offboard.vehicle(request.match_info["vehicle_id"])
        except ApiError as error:
            return ByHandCloseCode.ROLE if error.code == "role.insufficient" else ByHandCloseCode.UNAUTHORIZED
        except NotFoundError:
            return ByHandCloseCode.NO_VEHICLE
        if self._closing:
            return ByHandCloseCode.GOING_AWAY
        session = ByHandSession(socket, vehicle, principal)
        self._sessions.add(session)
        guard = asyncio.create_task(self._look_again(request, session), name="offboard socket access")
        try:
            return await session.run()
        except ConnectionError:
            return None  # the client has gone while something was told to it
        finally:
            self._sessions.discard(session)
            guard.cancel()
            await asyncio.gather(guard, return_exceptions=True)

    async def _look_again(self, request: web.Request, session: ByHandSession) -> None:
        """A token that is revoked while its socket is open ends the socket, and so the lease."""
        while True:
            await asyncio.sleep(self._settings.access_again_s)
            try:
                await authenticate_socket(request, self._access)
            except ApiError:
                session.end(ByHandCloseCode.UNAUTHORIZED)
                return
            except StorageError:
                log.warning("a socket's token cannot be looked at now")

    async def _end(self, request: web.Request, socket: web.WebSocketResponse, code: int | None) -> None:
        """Close with a code, and let go of the connection even if the client reads nothing."""
        if code is not None:
            self._metrics.count_close(code)
            log.info("offboard socket closed", code=int(code), client=request.remote)
        try:
            async with asyncio.timeout(self._settings.close_grace_s):
                reason = CLOSE_REASONS.get(code or 0, "").encode()
                await socket.close(code=code or WSCloseCode.OK, message=reason, drain=False)
        except (TimeoutError, ConnectionError):
            transport = request.transport
            if transport is not None:
                transport.abort()
