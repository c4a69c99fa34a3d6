"""CORS: pages of WAYDROP_ALLOWED_ORIGINS may call the API from a browser, which asks first and hides headers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from aiohttp import hdrs, web
from aiohttp.typedefs import Handler

from app.api.guard import normal_origin
from app.api.idempotency import REPLAYED

PREFLIGHT_S: Final = 600
"""How long a browser may remember the answer to a preflight."""
METHODS: Final = "GET, HEAD, POST, PUT, PATCH, DELETE"
REQUEST_HEADERS: Final = "Accept, Authorization, Content-Type, Idempotency-Key, If-None-Match, X-Request-ID"
EXPOSED: Final = f"Location, ETag, Link, Retry-After, Content-Disposition, WWW-Authenticate, X-Request-ID, {REPLAYED}"


class Cors:
    """Answers preflights of these origins and lets their pages read responses. Tokens are headers: no credentials."""

    def __init__(self, allowed_origins: Iterable[str]) -> None:
        self._origins = frozenset(normal_origin(origin) for origin in allowed_origins)

    @web.middleware
    async def preflights(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Answer a preflight of an allowed origin. All other requests go on."""
        is_preflight = request.method == hdrs.METH_OPTIONS and hdrs.ACCESS_CONTROL_REQUEST_METHOD in request.headers
        if not is_preflight or self._allowed(request) is None:
            return await handler(request)
        headers = {
            hdrs.ACCESS_CONTROL_ALLOW_METHODS: METHODS,
            hdrs.ACCESS_CONTROL_ALLOW_HEADERS: REQUEST_HEADERS,
            hdrs.ACCESS_CONTROL_MAX_AGE: str(PREFLIGHT_S),
        }
        return web.Response(status=204, headers=headers)

    async def add_headers(self, request: web.Request, response: web.StreamResponse) -> None:
        """Signal handler for on_response_prepare: errors are readable, too."""
        if not self._origins:
            return
        varies = response.headers.get(hdrs.VARY)
        response.headers[hdrs.VARY] = "Origin" if varies is None else f"{varies}, Origin"
        if (origin := self._allowed(request)) is not None:
            response.headers[hdrs.ACCESS_CONTROL_ALLOW_ORIGIN] = origin
            response.headers[hdrs.ACCESS_CONTROL_EXPOSE_HEADERS] = EXPOSED

    def _allowed(self, request: web.Request) -> str | None:
        """The Origin as the browser wrote it, if it is allowed."""
        origins = request.headers.getall(hdrs.ORIGIN, [])
        return origins[0] if len(origins) == 1 and normal_origin(origins[0]) in self._origins else None
