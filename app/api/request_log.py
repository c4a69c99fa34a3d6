"""One structured log line and one count for each request, with an id that its answer carries too."""

from __future__ import annotations

import re
import secrets
import time
from typing import Final

import structlog
from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from app.api.metrics import Metrics
from app.services.access import Principal

HEADER: Final = "X-Request-ID"
_GIVEN_ID: Final = re.compile(r"^[A-Za-z0-9._-]{1,64}$")
_ID: Final = web.RequestKey("request_id", str)
_PRINCIPAL: Final = web.RequestKey("principal", str)
log = structlog.get_logger(__name__)


def request_id(request: web.Request) -> str:
    """The id of this request: the client's own if it is usable, else a new one."""
    return request[_ID]


def note_principal(request: web.Request, principal: Principal) -> None:
    """Remember who asks, for the log line."""
    request[_PRINCIPAL] = principal.name


def route_of(request: web.Request) -> str:
    """The route's pattern (`/api/v1/runs/{run_id}`): few values, whatever is asked for."""
    resource = request.match_info.route.resource
    return resource.canonical if resource is not None else "unmatched"


def request_log(metrics: Metrics) -> Middleware:
    """The outermost middleware."""

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        given = request.headers.get(HEADER, "")
        request[_ID] = given if _GIVEN_ID.match(given) else secrets.token_hex(8)
        begun = time.perf_counter()
        status = 0  # of a request whose handling was cancelled
        try:
            response = await handler(request)
            status = response.status
            if not response.prepared:
                response.headers[HEADER] = request[_ID]
            return response
        finally:
            took_s = time.perf_counter() - begun
            metrics.count_request(request.method, route_of(request), status, took_s)
            log.info(
                "request",
                id=request[_ID],
                principal=request.get(_PRINCIPAL, "-"),
                method=request.method,
                route=route_of(request),
                status=status,
                ms=round(took_s * 1000, 1),
            )

    return middleware
