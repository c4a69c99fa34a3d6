"""What every websocket of ours asks of its handshake."""

from __future__ import annotations

from aiohttp import web

from app.api.authentication import SUBPROTOCOL
from app.api.guard import is_handshake
from app.api.problems import ApiError


def require_handshake(request: web.Request, *, hint: str) -> None:
    """Raises ApiError unless a websocket is asked for, with our subprotocol or none."""
    if not is_handshake(request):
        raise ApiError(
            "stream.upgrade_required",
            "this path speaks websocket only",
            hint=hint,
            headers={"Upgrade": "websocket", "Connection": "Upgrade"},
        )
    offered = [part.strip() for part in request.headers.get("Sec-WebSocket-Protocol", "").split(",")]
    if offered != [""] and SUBPROTOCOL not in offered:
        raise ApiError("stream.subprotocol", f"{SUBPROTOCOL} is not among the subprotocols offered")
