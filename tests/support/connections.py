"""Clients that send half a request, or open too much, shut nobody else out."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from urllib.parse import urlsplit

from aiohttp import web

from app.api.connections import ConnectionLimits
from app.api.server import serving

LIMITS = ConnectionLimits(most=12, most_per_address=8, head_s=20.0)


@asynccontextmanager
async def served(limits: ConnectionLimits) -> AsyncIterator[int]:
    """A service that says yes; its port."""

    async def yes(_: web.Request) -> web.Response:
        return web.Response(text="yes")

    async def large(_: web.Request) -> web.Response:
        return web.Response(body=bytes(4 * 1024 * 1024))

    async def slow(request: web.Request) -> web.StreamResponse:
        response = web.StreamResponse()
        await response.prepare(request)
        await asyncio.Event().wait()
        return response

    app = web.Application()
    app.router.add_get("/", yes)
    app.router.add_get("/large", large)
    app.router.add_get("/slow", slow)
    async with serving(app, "127.0.0.1", 0, limits) as url:
        yield urlsplit(url).port or 0
