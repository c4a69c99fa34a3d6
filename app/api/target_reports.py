"""The websocket for position reports of a moving target."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Mapping
from typing import Any, Final, Literal

from aiohttp import WSMsgType, web
from pydantic import BaseModel, ValidationError

from app.api.bodies import read_query
from app.api.observability import Metrics
from app.api.routing import NoQuery
from app.api.settings import ApiSettings
from app.api.targets import TargetView, require_feed
from app.api.websockets import (
    COMMON_CLOSE_REASONS,
    READS_TEXT,
    CloseCode,
    ErrorFrame,
    FrameId,
    SocketSession,
    WebSocketHandshake,
    bound_kernel_buffer,
    refused,
    require_handshake,
    unreadable,
    wait_until_writable,
)
from app.domain.errors import WaydropError
from app.domain.model import StrictForm
from app.domain.targets import TargetReport
from app.services.access import Access, Role
from app.services.background import end_tasks
from app.services.targets import Targets


class ReportFrame(StrictForm):
    """The target's position, as in POST /targets/{feed}. The path names the feed."""

    type: Literal["report"]
    id: FrameId | None = None
    report: TargetReport


class ReportAckFrame(BaseModel):
    """The report was accepted. Contains the target's current state."""

    type: Literal["report_ack"] = "report_ack"
    id: int | None = None
    target: TargetView


REPORTER_FRAMES: Final[tuple[type[BaseModel], ...]] = (ReportFrame,)
ANSWER_FRAMES: Final[tuple[type[BaseModel], ...]] = (ReportAckFrame, ErrorFrame)


REPORTS_CLOSE_REASONS: Final[Mapping[CloseCode, str]] = {
    **COMMON_CLOSE_REASONS,
    **READS_TEXT,
    CloseCode.ROLE: "the role dispatcher is required",
    CloseCode.TOO_SLOW: "the client does not read the answers",
}


# Each report is answered before the next one is read, so nothing queues up.


class ReportsSession(SocketSession):
    """Reads reports and answers them. A client that reads no answers for `send_timeout_s` is disconnected."""

    def __init__(
        self,
        socket: web.WebSocketResponse,
        transport: asyncio.WriteTransport,
        targets: Targets,
        feed: str,
        send_timeout_s: float,
    ) -> None:
        super().__init__()
        self._socket = socket
        self._transport = transport
        self._targets = targets
        self._feed = feed
        self._send_timeout_s = send_timeout_s

    async def run(self) -> CloseCode | None:
        """Serve until either side ends the session. Returns None if the client has gone."""
        reader = asyncio.create_task(self._read(), name="reports reader")
        waits: tuple[asyncio.Future[Any], ...] = (reader, self.ended)
        try:
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
            return self.ended.result() if self.ended.done() else reader.result()
        finally:
            await end_tasks(reader)

    async def _read(self) -> CloseCode | None:
        try:
            while True:
                message = await self._socket.receive()
                if message.type is WSMsgType.BINARY:
                    return CloseCode.UNSUPPORTED
                if message.type is not WSMsgType.TEXT:
                    return None
                await self._socket.send_str((await self._answer(message.data)).model_dump_json())
                await asyncio.sleep(0)  # buffered frames are read without a pause: yield to other tasks in between
                await wait_until_writable(self._transport, self._send_timeout_s)
        except TimeoutError:
            return CloseCode.TOO_SLOW
        except ConnectionError:
            return None

    async def _answer(self, text: str) -> BaseModel:
        try:
            frame = ReportFrame.model_validate_json(text)
        except ValidationError as error:
            return unreadable(text, ReportFrame, error)
        try:
            fix = await self._targets.accept(self._feed, frame.report)
        except WaydropError as error:
            return refused(frame.id, error)
        return ReportAckFrame(id=frame.id, target=TargetView.of(fix))


class ReportsEndpoint:
    """GET /api/v1/targets/{feed}/reports. The last report remains known after the socket closes, and ages."""

    def __init__(self, targets: Targets, access: Access, metrics: Metrics, settings: ApiSettings) -> None:
        self._targets = targets
        self._settings = settings
        self._handshake = WebSocketHandshake(
            "reports socket", REPORTS_CLOSE_REASONS, access, metrics, settings, max_sockets=settings.max_sockets
        )
        self.close = self._handshake.close

    async def report(self, request: web.Request) -> web.StreamResponse:
        require_handshake(request, hint="open a websocket, or send single reports with POST to the path of the target")
        feed = require_feed(request.match_info["feed"])
        return await self._handshake.open(
            request,
            lambda socket, _: self._serve(request, socket, feed),
            role=Role.DISPATCHER,
            heartbeat_s=self._settings.heartbeat_s,
            writer_limit=sys.maxsize,  # never wait inside aiohttp: see wait_until_writable
        )

    async def _serve(self, request: web.Request, socket: web.WebSocketResponse, feed: str) -> CloseCode | None:
        read_query(request, NoQuery)
        transport = request.transport
        if transport is None:
            return None
        bound_kernel_buffer(transport, self._settings.socket_buffer_bytes)
        session = ReportsSession(socket, transport, self._targets, feed, self._settings.send_timeout_s)
        return await self._handshake.run_session(request, session, session.run)
