"""Shared by all websockets: handshake, authentication, limits, rejections, backpressure."""

from __future__ import annotations

import asyncio
import socket as sockets
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from enum import IntEnum
from typing import Annotated, Any, Final, Literal

import structlog
from aiohttp import WSCloseCode, web
from pydantic import BaseModel, Field, ValidationError
from pydantic_core import to_jsonable_python

from app.api.authentication import LOCAL, SUBPROTOCOL, authenticate_socket, require_role
from app.api.bodies import QUERY_INVALID
from app.api.guard import is_handshake
from app.api.observability import Metrics, note_code, note_principal
from app.api.problems import ApiError, Boundary, kind_of
from app.api.settings import ApiSettings
from app.domain.errors import SetpointRefusedError, StorageError, TaskRefusedError, TooManyAttemptsError, WaydropError
from app.domain.validation import document_of, findings_of
from app.services.access import Access, Principal, Role
from app.services.background import background


class CloseCode(IntEnum):
    """Close codes of all websockets. Rejections use them too: browsers do not expose the HTTP status of a handshake."""

    GOING_AWAY = 1001
    UNSUPPORTED = 1003
    POLICY = 1008
    DEFECT = 1011
    TRY_AGAIN = 1013
    BAD_QUERY = 4400
    UNAUTHORIZED = 4401
    ROLE = 4403
    NO_VEHICLE = 4404
    TOO_SLOW = 4408
    AFTER_AHEAD = 4409
    LEASE_ENDED = 4410
    AFTER_PRUNED = 4411


COMMON_CLOSE_REASONS: Final[Mapping[CloseCode, str]] = {
    CloseCode.GOING_AWAY: "the service is shutting down",
    CloseCode.DEFECT: "internal server error",
    CloseCode.TRY_AGAIN: "temporarily unavailable; connect again later",
    CloseCode.BAD_QUERY: "this websocket takes no query parameters",
    CloseCode.UNAUTHORIZED: "a valid token is required",
}
"""What any websocket may be closed with, for people; at most 123 bytes (RFC 6455)."""


def require_handshake(request: web.Request, *, hint: str) -> None:
    """Raise ApiError unless the request is a websocket handshake with our subprotocol or none."""
    if not is_handshake(request):
        raise ApiError(
            "stream.upgrade_required",
            "this path accepts websocket connections only",
            hint=hint,
            headers={"Upgrade": "websocket", "Connection": "Upgrade"},
        )
    offered = [part.strip() for part in request.headers.get("Sec-WebSocket-Protocol", "").split(",")]
    if offered != [""] and SUBPROTOCOL not in offered:
        raise ApiError("stream.subprotocol", f"the client does not offer the subprotocol {SUBPROTOCOL}")


# Backpressure: detects a client that does not read, and limits its memory until then.


MAX_UNSENT_BYTES: Final = 64 * 1024
"""Bytes that may wait in the process for the client's kernel buffer."""

POLL_S: Final = 0.01


async def wait_until_writable(transport: asyncio.WriteTransport, timeout_s: float) -> None:
    """Return when little is left to send. Raises TimeoutError if the client reads too slowly."""
    # Not aiohttp's drain: after a task is cancelled in it, nothing more can be written, not even the close frame.
    loop = asyncio.get_running_loop()
    deadline_s = loop.time() + timeout_s
    while transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
        if loop.time() > deadline_s:
            raise TimeoutError
        await asyncio.sleep(POLL_S)


def bound_kernel_buffer(transport: asyncio.Transport, size_bytes: int) -> None:
    """By default, the kernel buffers megabytes for a client that reads nothing, which hides the problem."""
    raw = transport.get_extra_info("socket")
    if raw is not None:
        raw.setsockopt(sockets.SOL_SOCKET, sockets.SO_SNDBUF, size_bytes)


MAX_FINDINGS: Final = 3
FrameId = Annotated[int, Field(ge=0, le=2**53, description="returned in the answer")]


class ErrorFrame(BaseModel):
    """The request failed. `code` is stable; for a setpoint it is the code of the reason."""

    type: Literal["error"] = "error"
    id: int | None = None
    code: str
    detail: str
    hint: str = ""
    extra: dict[str, Any] = {}


class _Head(BaseModel):
    """The only field that is read from an invalid frame."""

    id: FrameId


def refused(frame_id: int | None, error: WaydropError) -> ErrorFrame:
    """Return the answer to a request that failed."""
    code = error.refusal if isinstance(error, SetpointRefusedError | TaskRefusedError) else error.code
    extra: dict[str, Any] = to_jsonable_python(dict(error.extra), fallback=str)
    return ErrorFrame(id=frame_id, code=code, detail=error.detail, hint=error.hint or kind_of(error).hint, extra=extra)


def unreadable(text: str, model: type[BaseModel], error: ValidationError) -> ErrorFrame:
    """Return the answer to an invalid frame, with its id if it has one."""
    found = findings_of(error, model, document_of(text), code_of="frame.{}".format)[:MAX_FINDINGS]
    detail = "; ".join(f"{one.message} (at {one.pointer})" if one.pointer else one.message for one in found)
    return ErrorFrame(id=_id_of(text), code="request.invalid", detail=detail, hint=found[0].hint)


def out_of_range(frame_id: int | None) -> ErrorFrame:
    """Return the answer to a valid frame whose values do not fit the MAVLink message."""
    detail = "a value derived from this request exceeds the range of the MAVLink message"
    return ErrorFrame(id=frame_id, code="request.invalid", detail=detail, hint="use smaller values")


def _id_of(text: str) -> int | None:
    try:
        return _Head.model_validate_json(text, strict=True).id
    except ValidationError:
        return None


MAX_INCOMING_BYTES: Final = 4096
log = structlog.get_logger(__name__)


READS_TEXT: Final[Mapping[CloseCode, str]] = {CloseCode.UNSUPPORTED: "frames are JSON texts, not binary"}
"""What a websocket that reads frames may be closed with besides."""


class SocketSession:
    """A session of a socket. `ended` has the close code once the service ends it."""

    def __init__(self) -> None:
        self.ended: asyncio.Future[CloseCode] = asyncio.get_running_loop().create_future()

    def end(self, code: CloseCode) -> None:
        """Close the socket with `code`. Only the first call has an effect."""
        if not self.ended.done():
            self.ended.set_result(code)


class ServedSocket(web.WebSocketResponse):
    """`closed_with` is the code by which aiohttp itself closed the socket: after a frame too large, or malformed."""

    closed_with: int | None = None

    async def close(self, *, code: int = WSCloseCode.OK, message: bytes = b"", drain: bool = True) -> bool:
        if not self.closed and code != WSCloseCode.OK:
            self.closed_with = code
        return await super().close(code=code, message=message, drain=drain)


class WebSocketHandshake:
    """The sockets of one path, at most `max_sockets` at once. `name` identifies them in the log."""

    def __init__(
        self,
        name: str,
        reasons: Mapping[CloseCode, str],
        access: Access,
        metrics: Metrics,
        settings: ApiSettings,
        *,
        max_sockets: int,
    ) -> None:
        self._name = name
        self._reasons = reasons
        self._access = access
        self._metrics = metrics
        self._settings = settings
        self._max_sockets = max_sockets
        self._sessions: set[SocketSession] = set()
        self._of_tokens: Counter[str] = Counter()
        self._refused = 0
        self._closing = False

    async def open(
        self,
        request: web.Request,
        serve: Callable[[web.WebSocketResponse, Principal], Awaitable[CloseCode | None]],
        *,
        role: Role,
        heartbeat_s: float,
        writer_limit: int = 64 * 1024,
    ) -> web.WebSocketResponse:
        """Open a socket, `serve` it if the role allows, and close it with the code that `serve` returns.

        None: the client has gone. `serve` may raise StorageError, ConnectionError if the client disconnects, and the
        ApiError of `read_query`.

        Raises:
            ApiError (503, 429): too many sockets, in total or of this token; (401, 403): too many rejections in
                progress.
        """
        try:
            principal = await self._admit(request, role)
        except (ApiError, StorageError, TooManyAttemptsError) as error:
            return await self._turn_away(request, error)
        self._take_place(principal)
        socket = self._socket(heartbeat_s, writer_limit)
        try:
            await socket.prepare(request)
            code: CloseCode | None = None
            with Boundary(request) as boundary:
                code = await self._served(lambda: serve(socket, principal))
            await self._shut(request, socket, code if boundary.problem is None else CloseCode.DEFECT)
        finally:
            self._give_place_back(principal)
        return socket

    async def run_session(
        self, request: web.Request, session: SocketSession, run: Callable[[], Awaitable[CloseCode | None]]
    ) -> CloseCode | None:
        """Run a session until it ends, the service stops, or its token is revoked."""
        if self._closing:
            return CloseCode.GOING_AWAY
        self._sessions.add(session)
        try:
            async with background(self._check_again(request, session), f"{self._name} access"):
                return await run()
        finally:
            self._sessions.discard(session)

    async def close(self) -> None:
        """Shut down: end all sockets, including those that are still being opened."""
        self._closing = True
        for session in self._sessions:
            session.end(CloseCode.GOING_AWAY)

    async def _admit(self, request: web.Request, role: Role) -> Principal:
        """Authenticate before taking a slot: rejected clients must not occupy one."""
        principal = await authenticate_socket(request, self._access)
        note_principal(request, principal)
        require_role(principal, role)
        return principal

    async def _turn_away(
        self, request: web.Request, error: ApiError | StorageError | TooManyAttemptsError
    ) -> web.WebSocketResponse:
        """Reject by close code, because browsers see nothing else, or by HTTP status if many are in progress."""
        note_code(request, error.code)
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

    def _code_of(self, error: ApiError | StorageError | TooManyAttemptsError) -> CloseCode:
        if isinstance(error, StorageError | TooManyAttemptsError):
            return CloseCode.TRY_AGAIN
        return CloseCode.ROLE if error.code == "role.insufficient" else CloseCode.UNAUTHORIZED

    async def _served(self, serve: Callable[[], Awaitable[CloseCode | None]]) -> CloseCode | None:
        try:
            return await serve()
        except StorageError:
            return CloseCode.TRY_AGAIN
        except ConnectionError:
            return None
        except ApiError as error:
            if error.code != QUERY_INVALID:
                raise
            return CloseCode.BAD_QUERY

    def _take_place(self, principal: Principal) -> None:
        if self._of_tokens.total() >= self._max_sockets:
            raise ApiError("stream.limit_reached", f"{self._of_tokens.total()} websockets are open, which is the limit")
        share = self._settings.max_sockets_per_token
        if principal is not LOCAL and self._of_tokens[_share_of(principal)] >= share:
            raise ApiError(
                "stream.token_limit_reached",
                f"{principal.name} has {share} open websockets, which is the limit",
                hint="close unused websockets",
            )
        self._of_tokens[_share_of(principal)] += 1
        self._metrics.sockets.inc()

    def _give_place_back(self, principal: Principal) -> None:
        self._metrics.sockets.dec()
        self._of_tokens[_share_of(principal)] -= 1
        self._of_tokens += Counter()  # drop counters at zero

    def _socket(self, heartbeat_s: float | None, writer_limit: int) -> ServedSocket:
        return ServedSocket(
            heartbeat=heartbeat_s,
            max_msg_size=MAX_INCOMING_BYTES,
            compress=False,
            protocols=(SUBPROTOCOL,),
            timeout=self._settings.close_grace_s,
            writer_limit=writer_limit,
        )

    async def _check_again(self, request: web.Request, session: SocketSession) -> None:
        """End a socket whose token is revoked."""
        while True:
            await asyncio.sleep(self._settings.access_again_s)
            if request.transport is None:
                return  # the client is gone: nobody to reject
            try:
                await authenticate_socket(request, self._access)
            except ApiError:
                session.end(CloseCode.UNAUTHORIZED)
                return
            except (StorageError, TooManyAttemptsError):
                log.warning("cannot check the token of a websocket")

    async def _shut(self, request: web.Request, socket: ServedSocket, code: CloseCode | None) -> None:
        """Close with a code, and drop the connection even if the client reads nothing."""
        transport = request.transport
        reason = b"" if code is None else self._reasons.get(code, "").encode()
        if (told := socket.closed_with if code is None else code) is not None:
            self._metrics.count_close(told)
            log.info(f"{self._name} closed", code=int(told), client=request.remote)
        try:
            async with asyncio.timeout(self._settings.close_grace_s):
                await socket.close(code=WSCloseCode.OK if code is None else code, message=reason, drain=False)
        except (TimeoutError, ConnectionError):
            pass  # it does not read: the close frame would wait behind unread data
        finally:
            if transport is not None and transport.get_write_buffer_size():
                transport.abort()


def _share_of(principal: Principal) -> str:
    """Identify tokens by ID, and clients without a token by name."""
    return principal.token_id or f"without a token: {principal.name}"
