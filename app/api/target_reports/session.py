"""One client that reports a target: each frame is answered before the next one is read, so nothing queues up."""

from __future__ import annotations

import asyncio
from typing import Any

from aiohttp import WSMsgType, web
from pydantic import BaseModel, ValidationError

from app.api.socket_answers import refused, unreadable
from app.api.target_reports.frames import ReportFrame, ReportsCloseCode, ReportTakenFrame
from app.api.targets import TargetView
from app.api.write_room import wait_for_room
from app.domain.errors import WaydropError
from app.services.targets import Targets


class ReportsSession:
    """Reads and answers. A client that takes no answers for `send_timeout_s` is cut."""

    def __init__(
        self,
        socket: web.WebSocketResponse,
        transport: asyncio.WriteTransport,
        targets: Targets,
        feed: str,
        send_timeout_s: float,
    ) -> None:
        self._socket = socket
        self._transport = transport
        self._targets = targets
        self._feed = feed
        self._send_timeout_s = send_timeout_s
        self._ended: asyncio.Future[ReportsCloseCode] = asyncio.get_running_loop().create_future()

    def end(self, code: ReportsCloseCode) -> None:
        """Close the socket with `code`. The first call counts."""
        if not self._ended.done():
            self._ended.set_result(code)

    async def run(self) -> ReportsCloseCode | None:
        """Serve until one side ends it; None if the client has gone."""
        reader = asyncio.create_task(self._read(), name="reports reader")
        waits: tuple[asyncio.Future[Any], ...] = (reader, self._ended)
        try:
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
            return self._ended.result() if self._ended.done() else reader.result()
        finally:
            reader.cancel()
            await asyncio.gather(reader, return_exceptions=True)

    async def _read(self) -> ReportsCloseCode | None:
        try:
            while True:
                message = await self._socket.receive()
                if message.type is not WSMsgType.TEXT:
                    return None
                await self._socket.send_str(self._answer(message.data).model_dump_json())
                await asyncio.sleep(0)  # frames that wait already are read without a pause: others come in between
                await wait_for_room(self._transport, self._send_timeout_s)
        except TimeoutError:
            return ReportsCloseCode.TOO_SLOW
        except ConnectionError:
            return None

    def _answer(self, text: str) -> BaseModel:
        try:
            frame = ReportFrame.model_validate_json(text)
        except ValidationError as error:
            return unreadable(text, ReportFrame, error)
        try:
            return ReportTakenFrame(id=frame.id, target=TargetView.of(self._targets.report(self._feed, frame.report)))
        except WaydropError as error:
            return refused(frame.id, error)
