"""One upload of one list through mavsdk's mission_raw, watched on the wire.

mavsdk says only that it failed; the vehicle's own MISSION_ACK and its last MISSION_REQUEST say why and at which item.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, Sequence
from dataclasses import dataclass

from app.domain.mission import MissionType
from app.vehicles.decoders import MissionAck, MissionRequest
from app.vehicles.inbox import Inbox
from app.vehicles.mavsdk_system import OUR_SYSTEM_ID, NativeSystem
from app.vehicles.mission_wire import WireItem
from app.vehicles.settings import LinkSettings

_ACK_BEHIND_S = 0.2
"""mavsdk's result may reach the loop before the message it came from."""


@dataclass(frozen=True, slots=True)
class UploadOutcome:
    """How an attempt ended. `result` is mavsdk's, or SILENT if we gave up; `ack` is the vehicle's MISSION_ACK."""

    result: str
    ack: MissionAck | None
    requested_seq: int | None
    ended_s: float


class UploadAttempt:
    """Use as `async with`: leaving it early cancels the transfer, on the vehicle too."""

    def __init__(
        self,
        system: NativeSystem,
        inbox: Inbox,
        settings: LinkSettings,
        mission_type: MissionType,
        items: Sequence[WireItem],
    ) -> None:
        self._system = system
        self._settings = settings
        self._type = mission_type
        self._items = items
        self._loop = asyncio.get_running_loop()
        self._moved = asyncio.Event()
        self._result: str | None = None
        self._ack: MissionAck | None = None
        self._requested: int | None = None
        self._ends = (inbox.on(MissionRequest, self._take_request), inbox.on(MissionAck, self._take_ack))

    async def __aenter__(self) -> UploadAttempt:
        self._system.upload(self._type, self._items, self._done_on_thread)
        return self

    async def __aexit__(self, *_exc: object) -> None:
        try:
            if self._result is None:
                self._system.cancel_transfers()
                await self._until_done(self._settings.close_timeout_s)
        finally:
            for end in self._ends:
                end()

    async def steps(self) -> AsyncGenerator[int, None]:
        """The number of items sent, as it grows; ends with the transfer or after too long a silence."""
        told_s = 0.0
        while self._result is None:
            self._moved.clear()
            try:
                async with asyncio.timeout(self._settings.transfer_silence_s):
                    await self._moved.wait()
            except TimeoutError:
                self._result = "SILENT"
                self._system.cancel_transfers()
                return
            now_s = time.monotonic()
            if self._requested is not None and now_s - told_s >= self._settings.progress_period_s:
                told_s = now_s
                yield self._requested

    async def outcome(self) -> UploadOutcome:
        """How it ended; call it when the steps are over."""
        ended_s = time.monotonic()
        if self._ack is None and self._result not in {"TIMEOUT", "SILENT", "BUSY"}:
            try:
                async with asyncio.timeout(_ACK_BEHIND_S):
                    while self._ack is None:
                        self._moved.clear()
                        await self._moved.wait()
            except TimeoutError:
                pass
        return UploadOutcome(self._result or "SILENT", self._ack, self._requested, ended_s)

    async def _until_done(self, timeout_s: float) -> None:
        try:
            async with asyncio.timeout(timeout_s):
                while self._result is None:
                    self._moved.clear()
                    await self._moved.wait()
        except TimeoutError:
            self._result = "SILENT"

    def _done_on_thread(self, result: str) -> None:
        try:
            self._loop.call_soon_threadsafe(self._done, result)
        except RuntimeError:
            return  # the loop has ended; nobody waits any more

    def _done(self, result: str) -> None:
        self._result = self._result or result
        self._moved.set()

    def _take_request(self, message: MissionRequest, _received_s: float) -> None:
        if message.mission_type == self._type and message.target_system in {0, OUR_SYSTEM_ID}:
            self._requested = message.seq
            self._moved.set()

    def _take_ack(self, message: MissionAck, _received_s: float) -> None:
        if message.mission_type == self._type and message.target_system == OUR_SYSTEM_ID:
            self._ack = message
            self._moved.set()
