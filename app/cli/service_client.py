"""The HTTP side of the commands that talk to a running Waydrop."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypeVar
from urllib.parse import urlsplit
from uuid import uuid4

import aiohttp
import typer

from app.cli.terminal import ServerRefusedError, ServerUnreachableError
from app.domain.errors import InvalidInputError
from app.domain.events import Event

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


T = TypeVar("T")
Query = str | int | None
"""Of one parameter of a query; None: not asked for."""


class ServiceClient:
    """Requests to one Waydrop. Every failure is a ServerUnreachableError or a ServerRefusedError."""

    def __init__(self, session: aiohttp.ClientSession, server: str) -> None:
        self._session = session
        self._server = server.rstrip("/")

    async def get(self, path: str, **query: Query) -> Any:
        """The JSON document at a path below /api/v1."""
        return await self._request("GET", path, params=_params(query))

    async def pages(self, path: str, rows: str, cursor: str, size: int, limit: int, **wanted: Query) -> list[Any]:
        """The newest `limit` entries of a list, `size` at a time; `cursor` asks for those behind a page."""
        found: list[Any] = []
        following: dict[str, Query] = {}
        while len(found) < limit:
            page = await self.get(path, **wanted, **following, limit=min(size, limit - len(found)))
            found += page[rows]
            if page["next"] is None:
                break
            following = {cursor: page["next"]}
        return found

    async def text(self, path: str, *, accept: str = "*/*", **query: Query) -> str:
        """Get the text at a path below /api/v1."""
        read, headers = aiohttp.ClientResponse.text, {"Accept": accept}
        return str(await self._request("GET", path, read=read, params=_params(query), headers=headers))

    async def post(self, path: str, document: Any = None) -> Any:
        """POST a JSON document; safe to send twice, for it carries an Idempotency-Key."""
        headers = {"Idempotency-Key": str(uuid4())}
        return await self._request("POST", path, json={} if document is None else document, headers=headers)

    async def patch(self, path: str, document: Any) -> Any:
        """PATCH a resource with a JSON document."""
        return await self._request("PATCH", path, json=document)

    async def delete(self, path: str) -> Any:
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
            f"Waydrop does not respond at {self._server}: {reason}",
            hint="start it with `waydrop up`, or specify its address with --server",
        )


@asynccontextmanager
async def service_client(server: str, token: str | None) -> AsyncIterator[ServiceClient]:
    """A client of the Waydrop at `server` (`http://host:port`)."""
    parts = urlsplit(server)
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        raise InvalidInputError(
            f"--server: {server!r} is not a valid address", hint="use the form http://127.0.0.1:8080"
        )
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    async with aiohttp.ClientSession(headers=headers, timeout=TIMEOUT) as session:
        yield ServiceClient(session, server)
        await asyncio.sleep(0)  # lets aiohttp close its transports


def with_client(server: str, token: str | None, use: Callable[[ServiceClient], Awaitable[T]]) -> T:
    """What a command does with a client, on an event loop of its own."""

    async def used() -> T:
        async with service_client(server, token) as client:
            return await use(client)

    return asyncio.run(used())


def _params(query: Mapping[str, Query]) -> dict[str, str]:
    return {key: str(value) for key, value in query.items() if value is not None}


async def _document(answer: aiohttp.ClientResponse) -> Any:
    if answer.status == 204 or not await answer.read():
        return None
    if not answer.content_type.endswith("json"):
        raise ServerRefusedError(
            "server.not_waydrop",
            f"{answer.url} answered {answer.status} {answer.content_type}: this is not Waydrop",
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
    return "specify a token with --token or WAYDROP_TOKEN" if status in {401, 403} else ""


FIRST_PAUSE_S: Final = 0.2
LONGEST_PAUSE_S: Final = 5.0


@dataclass(frozen=True, slots=True)
class StreamCut:
    """The connection is lost; the stream reconnects."""

    reason: str


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All vehicles and open runs as of event `seq`, after every connect."""

    seq: int
    vehicles: list[dict[str, Any]]
    runs: list[dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Telemetry:
    """The newest state of the vehicles that changed, by vehicle id."""

    states: dict[str, dict[str, Any]]


_FINAL_CLOSES: Final = {
    4400: "the service rejects this position in the stream",
    4401: "the service requires a valid token",
    4409: "the service has a different journal than before",
    4411: "the service has deleted events after this position in the stream, because they are old",
}
"""Close codes after which connecting again cannot help."""

StreamItem = Event | Snapshot | Telemetry | StreamCut


class EventStream:
    """`seq` is the position of the newest event. Away for `patience_s`, the stream raises ServerUnreachableError."""

    def __init__(self, client: ServiceClient, *, after: int | None = None, patience_s: float = 60.0) -> None:
        self._client = client
        self._patience_s = patience_s
        self.seq = after
        self._gateway: str | None = None

    async def items(self) -> AsyncIterator[StreamItem]:
        """Everything from now on (or from `after`), without end."""
        loop = asyncio.get_running_loop()
        away_since: float | None = None
        pause_s = FIRST_PAUSE_S
        while True:
            try:
                socket = await self._client.websocket("/stream" + self._query())
            except ServerUnreachableError:
                if away_since is None or loop.time() - away_since >= self._patience_s:
                    raise  # the very first connect is not tried again: the address may be wrong
                await asyncio.sleep(pause_s)
                pause_s = min(LONGEST_PAUSE_S, pause_s * 2)
                continue
            async with socket:
                pause_s = FIRST_PAUSE_S
                async for item in self._read(socket):
                    yield item
                    away_since = None
            _refuse_final_close(socket)
            away_since = away_since or loop.time()
            yield StreamCut(f"close code {socket.close_code}")
            await asyncio.sleep(pause_s)

    def _query(self) -> str:
        if self.seq is None:
            return ""
        return f"?after={self.seq}" + (f"&gateway={self._gateway}" if self._gateway else "")

    async def _read(self, socket: aiohttp.ClientWebSocketResponse) -> AsyncIterator[StreamItem]:
        async for message in socket:
            if message.type is not aiohttp.WSMsgType.TEXT:
                continue
            item = self._parsed(json.loads(message.data))
            if item is not None:
                yield item

    def _parsed(self, frame: dict[str, Any]) -> StreamItem | None:
        kind = frame.get("type")
        if kind == "event":
            event = Event.model_validate(frame["event"])
            if self.seq is not None and event.position <= self.seq:
                return None  # received before the disconnect
            self.seq = event.position
            return event
        if kind == "hello":
            self._gateway = str(frame["gateway"])
            if self.seq is None:
                self.seq = int(frame["seq"])  # without `after`, the events after this one follow
        if kind == "snapshot":
            return Snapshot(int(frame["seq"]), frame["vehicles"], frame["runs"])
        if kind == "telemetry":
            return Telemetry(frame["vehicles"])
        return None


def _refuse_final_close(socket: aiohttp.ClientWebSocketResponse) -> None:
    code = socket.close_code
    if code in _FINAL_CLOSES:
        raise ServerRefusedError("stream.closed", f"{_FINAL_CLOSES[code]} (close code {code})", status=code)
