"""What all websockets share: handshake, authentication, count, refusals, backpressure."""

from __future__ import annotations

import asyncio
import socket as sockets
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Generic, Literal, Protocol, TypeVar

import structlog
from aiohttp import WSCloseCode, web
from pydantic import BaseModel, Field, ValidationError
from pydantic_core import to_jsonable_python

from app.api.authentication import LOCAL, SUBPROTOCOL, authenticate_socket, require_role
from app.api.guard import is_handshake
from app.api.observability import Metrics, note_principal
from app.api.problems import ApiError, Boundary
from app.api.settings import ApiSettings
from app.domain.errors import SetpointRefusedError, StorageError, TaskRefusedError, WaydropError
from app.domain.validation import document_of, findings_of
from app.services.access import Access, Principal, Role

# What every websocket of ours asks of its handshake.


def require_handshake(request: web.Request, *, hint: str) -> None:
    """Raises ApiError unless a websocket is asked for, with our subprotocol or none."""
    if not is_handshake(request):
        raise ApiError(
            "stream.upgrade_required",
            "this path speaks websocket only",
            hint=hint,
            headers={"Upgrade": "websocket", "Connection": "Upgrade"},
        )
    offered = [part.strip() for part in request.headers.get("Sec-WebSocket-Protocol", "").split(",")]
    if offered != [""] and SUBPROTOCOL not in offered:
        raise ApiError("stream.subprotocol", f"{SUBPROTOCOL} is not among the subprotocols offered")


# Room to write to a client: a client that does not read is found out, and takes little memory until then.


MAX_UNSENT_BYTES: Final = 64 * 1024
"""What may wait in our process for a client's kernel buffer."""

POLL_S: Final = 0.01


async def wait_for_room(transport: asyncio.WriteTransport, timeout_s: float) -> None:
    """Return once little waits to be sent. Raises TimeoutError if the client takes too little for so long."""
    # Not by aiohttp's drain: once a task that waits in it has been cancelled, nothing can be written any more,
    # not even the close frame.
    loop = asyncio.get_running_loop()
    deadline_s = loop.time() + timeout_s
    while transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
        if loop.time() > deadline_s:
            raise TimeoutError
        await asyncio.sleep(POLL_S)


def bound_kernel_buffer(transport: asyncio.Transport, size_bytes: int) -> None:
    """Left alone, the kernel takes megabytes for a client that reads nothing, and it looks well for as long."""
    raw = transport.get_extra_info("socket")
    if raw is not None:
        raw.setsockopt(sockets.SOL_SOCKET, sockets.SO_SNDBUF, size_bytes)


# What sockets that answer frame by frame have in common: the id of a frame, and the refusal of one.


MAX_FINDINGS: Final = 3
FrameId = Annotated[int, Field(ge=0, le=2**53, description="comes back with the answer")]


class ErrorFrame(BaseModel):
    """What was asked is not done. Decide by `code`; for a setpoint it is the reason's own."""

    type: Literal["error"] = "error"
    id: int | None = None
    code: str
    detail: str
    hint: str = ""
    extra: dict[str, Any] = {}


class _Head(BaseModel):
    """All that is read of a frame that is unfit otherwise."""

    id: FrameId


def refused(frame_id: int | None, error: WaydropError) -> ErrorFrame:
    """The answer to what cannot be done."""
    code = error.refusal if isinstance(error, SetpointRefusedError | TaskRefusedError) else error.code
    extra: dict[str, Any] = to_jsonable_python(dict(error.extra), fallback=str)
    return ErrorFrame(id=frame_id, code=code, detail=error.detail, hint=error.hint, extra=extra)


def unreadable(text: str, model: type[BaseModel], error: ValidationError) -> ErrorFrame:
    """The answer to what is no frame of this model, with the id that it has all the same, if any."""
    found = findings_of(error, model, document_of(text), code_of="frame.{}".format)[:MAX_FINDINGS]
    detail = "; ".join(f"{one.message} (at {one.pointer})" if one.pointer else one.message for one in found)
    return ErrorFrame(id=_id_of(text), code="request.invalid", detail=detail, hint=found[0].hint)


def unspeakable(frame_id: int | None) -> ErrorFrame:
    """The answer to a frame that is fit by itself, and out of which no message to the vehicle can be made."""
    detail = "a number that follows from this is beyond what can be told to the vehicle"
    return ErrorFrame(id=frame_id, code="request.invalid", detail=detail, hint="ask for less")


def _id_of(text: str) -> int | None:
    try:
        return _Head.model_validate_json(text, strict=True).id
    except ValidationError:
        return None


# What every websocket of ours has in common: who may open it, that this is looked at again, its count and its end.


MAX_INCOMING_BYTES: Final = 4096
log = structlog.get_logger(__name__)
CodeT = TypeVar("CodeT", bound=int)
CodeT_contra = TypeVar("CodeT_contra", bound=int, contravariant=True)


class Endable(Protocol[CodeT_contra]):
    """A session that can be told to close its socket; the first call counts."""

    def end(self, code: CodeT_contra, /) -> None: ...


@dataclass(frozen=True, slots=True)
class CloseCodes(Generic[CodeT]):
    """A path's own close codes for what happens on every path, and the words that go with all of its codes.

    A browser sees no HTTP status of a handshake, so who may not open a socket is told by its close code. `role`: the
    token is valid, and may not do this; `try_again`: the storage does not answer.
    """

    going_away: CodeT
    unauthorized: CodeT
    role: CodeT
    try_again: CodeT
    defect: CodeT
    reasons: Mapping[CodeT, str]


class WebSocketHandshake(Generic[CodeT]):
    """The sockets of one path, at most `max_sockets` at once. `name` is how the log calls them."""

    def __init__(
        self,
        name: str,
        codes: CloseCodes[CodeT],
        access: Access,
        metrics: Metrics,
        settings: ApiSettings,
        *,
        max_sockets: int,
    ) -> None:
        self._name = name
        self._codes = codes
        self._access = access
        self._metrics = metrics
        self._settings = settings
        self._max_sockets = max_sockets
        self._sessions: set[Endable[CodeT]] = set()
        self._of_tokens: Counter[str] = Counter()
        self._refused = 0
        self._closing = False

    async def open(
        self,
        request: web.Request,
        serve: Callable[[web.WebSocketResponse, Principal], Awaitable[CodeT | None]],
        *,
        role: Role,
        heartbeat_s: float,
        writer_limit: int = 64 * 1024,
    ) -> web.WebSocketResponse:
        """Open a socket, `serve` it to whoever has the role, and close it with the code that this gives.

        None: the client has gone. `serve` may raise StorageError, and ConnectionError when the client goes meanwhile.

        Raises:
            ApiError (503, 429): too many are open, in all or of this token; (401, 403): too many are being refused.
        """
        try:
            principal = await self._admit(request, role)
        except (ApiError, StorageError) as error:
            return await self._turn_away(request, error)
        self._take_place(principal)
        socket = self._socket(heartbeat_s, writer_limit)
        try:
            await socket.prepare(request)
            code: CodeT | None = None
            with Boundary(request) as boundary:
                code = await self._served(lambda: serve(socket, principal))
            await self._shut(request, socket, code if boundary.problem is None else self._codes.defect)
        finally:
            self._give_place_back(principal)
        return socket

    async def attend(
        self, request: web.Request, session: Endable[CodeT], run: Callable[[], Awaitable[CodeT | None]]
    ) -> CodeT | None:
        """Run a session that can be ended: by a stop of the service, and by its token's revocation."""
        if self._closing:
            return self._codes.going_away
        self._sessions.add(session)
        guard = asyncio.create_task(self._look_again(request, session), name=f"{self._name} access")
        try:
            return await run()
        finally:
            self._sessions.discard(session)
            guard.cancel()
            await asyncio.gather(guard, return_exceptions=True)

    async def close(self) -> None:
        """The service stops: end all sockets, and those that are just being opened as soon as they are."""
        self._closing = True
        for session in self._sessions:
            session.end(self._codes.going_away)

    async def _admit(self, request: web.Request, role: Role) -> Principal:
        """Who asks. Before a place is taken: who may not have one must not hold one either."""
        principal = await authenticate_socket(request, self._access)
        note_principal(request, principal)
        require_role(principal, role)
        return principal

    async def _turn_away(self, request: web.Request, error: ApiError | StorageError) -> web.WebSocketResponse:
        """Tell by a close code, since a browser sees nothing else; if many are being told, by the status alone."""
        if self._refused >= self._settings.max_refused_sockets:
            raise error
        self._refused += 1
        try:
            socket = self._socket(heartbeat_s=None, writer_limit=MAX_INCOMING_BYTES)
            await socket.prepare(request)
            await self._shut(request, socket, self._code_of(error))
        finally:
            self._refused -= 1
        return socket

    def _code_of(self, error: ApiError | StorageError) -> CodeT:
        if isinstance(error, StorageError):
            return self._codes.try_again
        return self._codes.role if error.code == "role.insufficient" else self._codes.unauthorized

    async def _served(self, serve: Callable[[], Awaitable[CodeT | None]]) -> CodeT | None:
        try:
            return await serve()
        except StorageError:
            return self._codes.try_again
        except ConnectionError:
            return None

    def _take_place(self, principal: Principal) -> None:
        if self._of_tokens.total() >= self._max_sockets:
            raise ApiError("stream.limit_reached", f"{self._of_tokens.total()} sockets are open, no more are taken")
        share = self._settings.max_sockets_per_token
        if principal is not LOCAL and self._of_tokens[_share_of(principal)] >= share:
            raise ApiError(
                "stream.token_limit_reached", f"{principal.name} has {share} sockets open", hint="close some"
            )
        self._of_tokens[_share_of(principal)] += 1
        self._metrics.sockets.inc()

    def _give_place_back(self, principal: Principal) -> None:
        self._metrics.sockets.dec()
        self._of_tokens[_share_of(principal)] -= 1
        self._of_tokens += Counter()  # those without any are forgotten

    def _socket(self, heartbeat_s: float | None, writer_limit: int) -> web.WebSocketResponse:
        return web.WebSocketResponse(
            heartbeat=heartbeat_s,
            max_msg_size=MAX_INCOMING_BYTES,
            compress=False,
            protocols=(SUBPROTOCOL,),
            timeout=self._settings.close_grace_s,
            writer_limit=writer_limit,
        )

    async def _look_again(self, request: web.Request, session: Endable[CodeT]) -> None:
        """A token that is revoked while its socket is open ends the socket."""
        while True:
            await asyncio.sleep(self._settings.access_again_s)
            if request.transport is None:
                return  # the client has gone: nobody is left to be refused
            try:
                await authenticate_socket(request, self._access)
            except ApiError:
                session.end(self._codes.unauthorized)
                return
            except StorageError:
                log.warning("a socket's token cannot be looked at now")

    async def _shut(self, request: web.Request, socket: web.WebSocketResponse, code: CodeT | None) -> None:
        """Close with a code, and let go of the connection even if the client reads nothing."""
        transport = request.transport
        reason = b""
        if code is not None:
            self._metrics.count_close(code)
            log.info(f"{self._name} closed", code=int(code), client=request.remote)
            reason = self._codes.reasons.get(code, "").encode()
        try:
            async with asyncio.timeout(self._settings.close_grace_s):
                await socket.close(code=WSCloseCode.OK if code is None else code, message=reason, drain=False)
        except (TimeoutError, ConnectionError):
            pass  # it does not read: the close frame waits behind what it did not take
        finally:
            if transport is not None and transport.get_write_buffer_size():
                transport.abort()


def _share_of(principal: Principal) -> str:
    """Tokens are told apart by their ids; what has none, by its name."""
    return principal.token_id or f"without a token: {principal.name}"
