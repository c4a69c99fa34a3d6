"""Serves the application on one address, and reports a clear error if it cannot."""

from __future__ import annotations

import asyncio
import errno
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final

import structlog
from aiohttp import web

from app.api.connections import ConnectionLimits, Connections
from app.api.guard import set_security_headers
from app.api.problems import http_problem, internal_problem
from app.api.tls import ListenError, TlsFiles, certificate

# Answers requests that aiohttp cannot parse, which never reach the application.
#
# aiohttp would log their traceback, including header values, and respond in plain text with its version.


log = structlog.get_logger(__name__)


class RequestProtocol(web.RequestHandler):
    """aiohttp's connection protocol that reports sent responses, and responds to malformed requests by itself."""

    __slots__ = ("on_response",)

    def __init__(self, manager: web.Server, **options: Any) -> None:
        super().__init__(manager, **options)
        self.on_response: Callable[[], None] = lambda: None

    async def finish_response(
        self, request: web.BaseRequest, resp: web.StreamResponse, start_time: float | None
    ) -> tuple[web.StreamResponse, bool]:
        """Send the response, then call `on_response`."""
        try:
            return await super().finish_response(request, resp, start_time)
        finally:
            self.on_response()

    def handle_error(
        self,
        request: web.BaseRequest,
        status: int = 500,
        exc: BaseException | None = None,
        message: str | None = None,
    ) -> web.StreamResponse:
        """Respond with a problem. `exc` and `message` may quote the request, so they are neither sent nor logged."""
        if request.writer.output_size > 0:
            raise ConnectionError("the response has already started")
        identity = secrets.token_hex(8)
        if status == web.HTTPBadRequest.status_code:
            log.debug("malformed request", id=identity, client=request.remote, error=type(exc).__name__)
            answer = http_problem(web.HTTPBadRequest(), request_id=identity)
        else:
            log.error("defect", incident=identity, exc_info=exc)
            answer = internal_problem(request_id=identity)
        set_security_headers(answer)
        answer.force_close()
        return answer


SHUTDOWN_S: Final = 1.0
"""Time limit for requests in progress at shutdown."""

BACKLOG: Final = 128
"""Length of the kernel's accept queue."""


@asynccontextmanager
async def serving(
    app: web.Application,
    host: str,
    port: int,
    limits: ConnectionLimits | None = None,
    tls: TlsFiles | None = None,
) -> AsyncIterator[str]:
    """Serve until the block ends; yields the URL of the service.

    Raises:
        ListenError: the port is in use, the host is not an address of this machine, or the certificate cannot be used.
    """
    limits = limits or ConnectionLimits()
    runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=SHUTDOWN_S)
    async with certificate(tls) as used:
        await runner.setup()
        try:
            connections = Connections(_protocols(runner, limits), limits, used)
            async with _listening(connections, host, port) as bound_port:
                shown = f"[{host}]" if ":" in host else host
                yield f"{'http' if used is None else 'https'}://{shown}:{bound_port}"
        finally:
            await runner.cleanup()


def _protocols(runner: web.AppRunner, limits: ConnectionLimits) -> Callable[[], RequestProtocol]:
    server, loop = runner.server, asyncio.get_running_loop()
    if server is None:
        raise AssertionError("the runner is not set up")
    options: dict[str, Any] = {
        "keepalive_timeout": limits.idle_s,
        "access_log": None,
    }  # None: the application logs requests itself
    return lambda: RequestProtocol(server, loop=loop, **options)


@asynccontextmanager
async def _listening(connections: Connections, host: str, port: int) -> AsyncIterator[int]:
    """Accept connections until the block ends. Yields the port."""
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
            f"port {port} on {host} is already in use",
            hint="stop the program that uses it (another Waydrop?), or choose another port with --port or WAYDROP_PORT",
        )
    if error.errno == errno.EACCES:
        return ListenError(f"permission denied to listen on port {port}", hint="choose a port above 1023")
    return ListenError(f"cannot listen on {host}:{port}: {error.strerror or error}", hint="choose another host")
