"""Serves the application on one address, and says plainly when that cannot be."""

from __future__ import annotations

import asyncio
import errno
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final

from aiohttp import web

from app.api.connections import ConnectionLimits, Connections
from app.api.unreadable import RequestProtocol
from app.domain.errors import WaydropError

SHUTDOWN_S: Final = 1.0
"""How long requests under way may take to end at a shutdown."""

BACKLOG: Final = 128
"""Connections that wait in the kernel to be taken."""


class ListenError(WaydropError):
    """The address cannot be listened on."""

    code = "listen.failed"


@asynccontextmanager
async def serving(
    app: web.Application, host: str, port: int, limits: ConnectionLimits | None = None
) -> AsyncIterator[str]:
    """Serve until the block ends; yields the URL that it can be reached at.

    Raises:
        ListenError: the port is taken, or the host is none of this machine's.
    """
    limits = limits or ConnectionLimits()
    runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=SHUTDOWN_S)
    await runner.setup()
    try:
        async with _listening(Connections(_protocols(runner, limits), limits), host, port) as bound_port:
            shown = f"[{host}]" if ":" in host else host
            yield f"http://{shown}:{bound_port}"
    finally:
        await runner.cleanup()


def _protocols(runner: web.AppRunner, limits: ConnectionLimits) -> Callable[[], asyncio.Protocol]:
    server, loop = runner.server, asyncio.get_running_loop()
    if server is None:
        raise AssertionError("the runner is set up")
    options: dict[str, Any] = {"keepalive_timeout": limits.idle_s, "access_log": None}  # None: it logs no requests
    return lambda: RequestProtocol(server, loop=loop, **options)


@asynccontextmanager
async def _listening(connections: Connections, host: str, port: int) -> AsyncIterator[int]:
    """Take connections until the block ends; yields the port."""
    loop = asyncio.get_running_loop()
    try:
        server = await loop.create_server(connections, host, port, backlog=BACKLOG)
    except OSError as error:
        raise _in_words(error, host, port) from error
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()


def _in_words(error: OSError, host: str, port: int) -> ListenError:
    if error.errno == errno.EADDRINUSE:
        return ListenError(
            f"port {port} on {host} is in use",
            hint="end what uses it (another Waydrop?), or choose another port: WAYDROP_PORT or --port",
        )
    if error.errno == errno.EACCES:
        return ListenError(f"no right to listen on port {port}", hint="choose a port above 1023")
    return ListenError(f"cannot listen on {host}:{port}: {error.strerror or error}", hint="choose another host")
