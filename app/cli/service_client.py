"""The HTTP side of the commands that talk to a running Waydrop."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypeVar
from urllib.parse import urlsplit
from uuid import uuid4

import aiohttp
import typer
from pydantic import BaseModel, ValidationError

from app.cli.terminal import AnswerLostError, ServerRefusedError, ServerUnreachableError
from app.cli.variables import variable
from app.domain.errors import InvalidInputError
from app.domain.events import Event

DEFAULT_SERVER: Final = "http://127.0.0.1:8080"
TIMEOUT: Final = aiohttp.ClientTimeout(total=60.0, sock_connect=5.0)
HEARTBEAT_S: Final = 10.0
MAX_FRAME_BYTES: Final = 16 * 1024 * 1024
REPEATED_FOR_S: Final = 10.0
"""A POST whose answer is lost is repeated for so long: nobody wants what he ordered a minute ago."""
_NOT_SENT: Final = (aiohttp.ClientConnectorError, aiohttp.ConnectionTimeoutError)
GATEWAY_STATUSES: Final = {502, 503, 504}
"""Of a proxy before a Waydrop that is not there."""


def default_server() -> str:
    """The service on this machine with the port and TLS of its variables."""
    port = variable("WAYDROP_PORT") or "8080"
    return f"http{'s' if variable('WAYDROP_TLS_CERT') else ''}://127.0.0.1:{port}"


ServerOption = Annotated[
    str,
    typer.Option("--server", envvar="WAYDROP_SERVER", default_factory=default_server, help="Where Waydrop answers."),
]
TokenOption = Annotated[
    str | None,
    typer.Option("--token", envvar="WAYDROP_TOKEN", help="Bearer token; not needed before the first token exists."),
]


T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)
Query = str | int | None
"""Of one parameter of a query; None: not asked for."""


class ServiceClient:
    """Requests to one Waydrop. Every failure is a ServerUnreachableError, AnswerLostError or ServerRefusedError."""

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

    async def post(self, path: str, document: Any = None, *, repeats: bool = True) -> Any:
        """POST a JSON document. It carries an Idempotency-Key: if the answer gets lost, it is sent again, unless the
        route takes no key.

        Raises AnswerLostError: it was sent, and there is no answer yet. What it orders may have been done.
        """
        loop, headers = asyncio.get_running_loop(), {"Idempotency-Key": str(uuid4())}
        until_s, pause_s, was_sent = loop.time() + (REPEATED_FOR_S if repeats else 0.0), FIRST_PAUSE_S, False
        while True:
            try:
                return await self._request("POST", path, json={} if document is None else document, headers=headers)
            except ServerUnreachableError as error:
                was_sent = was_sent or not isinstance(error.__cause__, _NOT_SENT)
                if not was_sent:
                    raise
                if loop.time() + pause_s > until_s:
                    raise AnswerLostError(
                        f"{error.detail}. The request was sent: it may have been carried out",
                        hint="look whether it was (`waydrop vehicles`, `runs`, `jobs list`) before you repeat it",
                    ) from error
            await asyncio.sleep(pause_s)
            pause_s = min(LONGEST_PAUSE_S, pause_s * 2)

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
        if {"?", "#", "%"} & set(path) or ".." in path.split("/"):
            raise InvalidInputError(f"{path!r} has an ID that cannot exist", hint="copy the ID from a list")
        try:
            async with self._session.request(method, f"{self._server}/api/v1{path}", **arguments) as answer:
                if answer.status in GATEWAY_STATUSES and not answer.content_type.endswith("json"):
                    answer.raise_for_status()
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
    if not _is_address(server):
        raise InvalidInputError(
            f"--server: {server!r} is not a valid address", hint="use the form http://127.0.0.1:8080"
        )
    if token and not (token.isascii() and token.isprintable()):
        raise InvalidInputError(
            "--token: the token has a line break or another character that no token has", hint="copy it anew"
        )
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    async with aiohttp.ClientSession(headers=headers, timeout=TIMEOUT) as session:
        yield ServiceClient(session, server)
        await asyncio.sleep(0)  # lets aiohttp close its transports


def _is_address(server: str) -> bool:
    try:
        parts = urlsplit(server)
        return parts.scheme in {"http", "https"} and bool(parts.hostname) and parts.port != 0 and not parts.query
    except ValueError:  # of a port or an IPv6 address
        return False


def with_client(server: str, token: str | None, use: Callable[[ServiceClient], Awaitable[T]]) -> T:
    """What a command does with a client, on an event loop of its own."""

    async def used() -> T:
        async with service_client(server, token) as client:
            return await use(client)

    return asyncio.run(used())


def _params(query: Mapping[str, Query]) -> dict[str, str]:
    return {key: str(value) for key, value in query.items() if value is not None}


class _Document(dict[str, Any]):
    """A JSON object of the service."""

    def __missing__(self, name: str) -> Any:
        raise _of_another_version(f"no {name!r}")


def parsed(model: type[M], document: Any) -> M:
    """A document, or a part of one, as the model that it is. Raises ServerRefusedError."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise _of_another_version(f"no {model.__name__}: {error.errors()[0]['msg']}") from error


def _of_another_version(what: str) -> ServerRefusedError:
    return ServerRefusedError(
        "server.not_waydrop",
        f"the answer has {what}: this is not Waydrop, or another version of it",
        status=200,
        hint="look at --server; use the command of the version that runs there",
    )


async def _document(answer: aiohttp.ClientResponse) -> Any:
    if answer.status == 204:
        return None
    try:
        if not answer.content_type.endswith("json"):
            raise ValueError("not JSON")
        document = json.loads(await answer.read())
        if not isinstance(document, dict):
            raise ValueError("no object")
        return _Document(document)
    except ValueError as error:
        raise ServerRefusedError(
            "server.not_waydrop",
            f"{answer.url} answered {answer.status} {answer.content_type}: this is not Waydrop",
            status=answer.status,
            hint="look at --server",
        ) from error


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
            event = parsed(Event, frame["event"])
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
