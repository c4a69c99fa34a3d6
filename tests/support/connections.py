"""Clients that send half a request, or open too much, shut nobody else out."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from urllib.parse import urlsplit

from aiohttp import web

from app.api.server import ConnectionLimits, serving

LIMITS = ConnectionLimits(most=12, most_per_address=8, head_s=20.0)


@asynccontextmanager
async def served(limits: ConnectionLimits) -> AsyncIterator[int]:
    """A service that says yes; its port."""

    async def yes(_: web.Request) -> web.Response:
        return web.Response(text="yes")

    app = web.Application()
    app.router.add_get("/", yes)
    async with serving(app, "127.0.0.1", 0, limits) as url:
        yield urlsplit(url).port or 0
