"""The HTTP side of the commands that talk to a running Waydrop."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Annotated, Any, Final
from urllib.parse import urlsplit
from uuid import uuid4

import aiohttp
import typer

from app.cli.exit_status import ServerRefusedError, ServerUnreachableError
from app.domain.errors import InvalidInputError

DEFAULT_SERVER: Final = "http://127.0.0.1:8080"
TIMEOUT: Final = aiohttp.ClientTimeout(total=60.0, sock_connect=5.0)
HEARTBEAT_S: Final = 10.0
MAX_FRAME_BYTES: Final = 16 * 1024 * 1024


def default_server() -> str:
    """The service on this machine, at the port that WAYDROP_PORT names."""
    port = os.environ.get("WAYDROP_PORT")
    return f"http://127.0.0.1:{port}" if port else DEFAULT_SERVER


ServerOption = Annotated[
    str,
    typer.Option("--server", envvar="WAYDROP_SERVER", default_factory=default_server, help="Where Waydrop answers."),
]
TokenOption = Annotated[
    str | None, typer.Option("--token", envvar="WAYDROP_TOKEN", help="Bearer token; not needed on loopback.")
]


class ServiceClient:
    """Requests to one Waydrop. Every failure is a ServerUnreachableError or a ServerRefusedError."""

    def __init__(self, session: aiohttp.ClientSession, server: str) -> None:
        self._session = session
        self._server = server.rstrip("/")

    async def get(self, path: str, **query: str | int) -> Any:
        """The JSON document at a path below /api/v1."""
        return await self._request("GET", path, params={key: str(value) for key, value in query.items()})

    async def text(self, path: str, *, accept: str = "*/*", **query: str | int) -> str:
        """What a path below /api/v1 gives, as text."""
        params = {key: str(value) for key, value in query.items()}
        headers = {"Accept": accept}
        return str(await self._request("GET", path, read=aiohttp.ClientResponse.text, params=params, headers=headers))

    async def post(self, path: str, document: Any = None) -> Any:
        """POST a JSON document; safe to send twice, for it carries an Idempotency-Key."""
        headers = {"Idempotency-Key": str(uuid4())}
        return await self._request("POST", path, json={} if document is None else document, headers=headers)

    async def patch(self, path: str, document: Any) -> Any:
        """PATCH a resource with a JSON document."""
        return await self._request("PATCH", path, json=document)

    async def delete(self, path: str) -> Any:
        """DELETE a resource."""
        return await self._request("DELETE", path)

    async def websocket(self, path: str) -> aiohttp.ClientWebSocketResponse:
        """Open a websocket below /api/v1."""
        try:
            return await self._session.ws_connect(
                f"{self._server}/api/v1{path}", heartbeat=HEARTBEAT_S, max_msg_size=MAX_FRAME_BYTES
            )
        except aiohttp.WSServerHandshakeError as error:
            if error.status >= 500:
                raise self._unreachable(error) from error
            raise ServerRefusedError(
                f"http.{error.status}", f"{path}: {error.message}", status=error.status, hint=_access_hint(error.status)
            ) from error
        except (aiohttp.ClientError, TimeoutError) as error:
            raise self._unreachable(error) from error

    async def _request(
        self,
        method: str,
        path: str,
        read: Callable[[aiohttp.ClientResponse], Awaitable[Any]] | None = None,
        **arguments: Any,
    ) -> Any:
        try:
            async with self._session.request(method, f"{self._server}/api/v1{path}", **arguments) as answer:
                if answer.status >= 400:
                    raise _refusal(answer.status, await _document(answer), path)
                return await (read or _document)(answer)
        except (aiohttp.ClientError, TimeoutError) as error:
            raise self._unreachable(error) from error

    def _unreachable(self, error: BaseException) -> ServerUnreachableError:
        reason = str(error) or type(error).__name__
        if isinstance(error, aiohttp.ClientConnectorError):
            reason = str(error.os_error.strerror or error.os_error)
        return ServerUnreachableError(
            f"no Waydrop answers at {self._server}: {reason}",
            hint="start one with `waydrop up`, or name it by --server",
        )


@asynccontextmanager
async def service_client(server: str, token: str | None) -> AsyncIterator[ServiceClient]:
    """A client of the Waydrop at `server` (`http://host:port`)."""
    parts = urlsplit(server)
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        raise InvalidInputError(f"--server: {server!r} is no address", hint="write it as http://127.0.0.1:8080")
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    async with aiohttp.ClientSession(headers=headers, timeout=TIMEOUT) as session:
        yield ServiceClient(session, server)
        await asyncio.sleep(0)  # lets aiohttp close its transports


async def _document(answer: aiohttp.ClientResponse) -> Any:
    if answer.status == 204 or not await answer.read():
        return None
    if not answer.content_type.endswith("json"):
        raise ServerRefusedError(
            "server.not_waydrop",
            f"{answer.url} answered {answer.status} {answer.content_type}: that is no Waydrop",
            status=answer.status,
            hint="look at --server",
        )
    return await answer.json(content_type=None)


def _refusal(status: int, document: Any, path: str) -> ServerRefusedError:
    problem = document if isinstance(document, dict) else {}
    known = {"code", "detail", "hint", "status", "title", "type"}
    return ServerRefusedError(
        str(problem.get("code", f"http.{status}")),
        str(problem.get("detail") or problem.get("title") or f"{path}: HTTP {status}"),
        status=status,
        hint=str(problem.get("hint") or _access_hint(status)),
        **{key: value for key, value in problem.items() if key not in known},
    )


def _access_hint(status: int) -> str:
    return "give a token with --token or WAYDROP_TOKEN" if status in {401, 403} else ""
