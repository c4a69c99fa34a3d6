"""From a row of the route table to an aiohttp handler: role, query, body, idempotency, then the row's own handler."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Awaitable, Callable
from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api.authentication import PUBLIC, authenticate, require_role
from app.api.bodies import check_head, read_body, read_query
from app.api.body_room import BodyRoom
from app.api.idempotency import Idempotency
from app.api.request_log import note_principal
from app.api.routing import AnyRoute, Call
from app.services.access import Access, Principal

LARGE_BYTES: Final = 4 * 1024
"""A body beyond this is read in a thread, or vehicles that are flown by setpoints would wait for it."""
HttpHandler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def make_endpoint(
    route: AnyRoute, *, access: Access, idempotency: Idempotency, room: BodyRoom, body_timeout_s: float
) -> HttpHandler:
    """The handler that aiohttp calls for a route. All checks that the route's row promises are made here."""

    async def endpoint(request: web.Request) -> web.StreamResponse:
        principal = await _principal(route, request, access)
        note_principal(request, principal)
        query = read_query(request, route.query)
        if route.method == "GET":
            return await answer(request, principal, query, b"")
        largest_bytes = route.body.max_bytes or request.client_max_size
        check_head(request, route.body, most_bytes=largest_bytes)
        if route.before_body is not None:
            await route.before_body(request)
        with room.held(request, largest_bytes):
            raw = await read_body(request, route.body, timeout_s=body_timeout_s)
            return await answer(request, principal, query, raw)

    async def answer(request: web.Request, principal: Principal, query: BaseModel, raw: bytes) -> web.StreamResponse:
        body = await asyncio.to_thread(route.body.parse, raw) if len(raw) > LARGE_BYTES else route.body.parse(raw)
        call = Call(request, principal, query, body)
        if not route.idempotent:
            return await route.handler(call)
        return await idempotency.answer(
            request, principal, hashlib.sha256(raw).hexdigest(), lambda: route.handler(call)
        )

    return endpoint


async def _principal(route: AnyRoute, request: web.Request, access: Access) -> Principal:
    if route.role is None:
        return PUBLIC
    principal = await authenticate(request, access)
    require_role(principal, route.role)
    return principal
