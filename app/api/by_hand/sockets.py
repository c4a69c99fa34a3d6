"""The offboard websocket's path: who may open one, and what it serves."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from app.api.by_hand.frames import CLOSE_REASONS, ByHandCloseCode
from app.api.by_hand.session import ByHandSession
from app.api.handshake import require_handshake
from app.api.metrics import Metrics
from app.api.settings import ApiSettings
from app.api.socket_door import CloseCodes, SocketDoor
from app.domain.errors import NotFoundError
from app.services.access import Access, Principal, Role
from app.services.offboard import Offboard
from app.services.tasks import Tasks

MAX_SOCKETS: Final = 64
HEARTBEAT_S: Final = 5.0
_CODES: Final = CloseCodes(
    going_away=ByHandCloseCode.GOING_AWAY,
    unauthorized=ByHandCloseCode.UNAUTHORIZED,
    role=ByHandCloseCode.ROLE,
    try_again=ByHandCloseCode.TRY_AGAIN,
    defect=ByHandCloseCode.DEFECT,
    reasons=CLOSE_REASONS,
)


class ByHandEndpoint:
    """GET /api/v1/vehicles/{vehicle_id}/offboard as a websocket. The end of its socket ends a lease."""

    def __init__(
        self, offboard: Offboard, tasks: Tasks, access: Access, metrics: Metrics, settings: ApiSettings
    ) -> None:
        self._offboard = offboard
        self._tasks = tasks
        self._door = SocketDoor("offboard socket", _CODES, access, metrics, settings, max_sockets=MAX_SOCKETS)
        self.close = self._door.close

    async def fly(self, request: web.Request) -> web.StreamResponse:
        """The handler."""
        require_handshake(request, hint="open it as a websocket; single setpoints go by POST .../offboard/setpoint")
        return await self._door.open(
            request,
            lambda socket, principal: self._serve(request, socket, principal),
            role=Role.PILOT,
            heartbeat_s=HEARTBEAT_S,
        )

    async def _serve(
        self, request: web.Request, socket: web.WebSocketResponse, principal: Principal
    ) -> ByHandCloseCode | None:
        try:
            vehicle = self._offboard.vehicle(request.match_info["vehicle_id"])
            desk = self._tasks.vehicle(request.match_info["vehicle_id"])
        except NotFoundError:
            return ByHandCloseCode.NO_VEHICLE
        session = ByHandSession(socket, vehicle, desk, principal)
        return await self._door.attend(request, session, session.run)
