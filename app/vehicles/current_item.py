"""Making a mission item current: command 224, and MISSION_SET_CURRENT for firmware that does not know it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from app.domain.commands import MavResult
from app.domain.errors import LinkTimeoutError, VehicleRefusedError
from app.domain.mission import MavCmd
from app.vehicles.command_sender import CommandSender, command
from app.vehicles.decoders import MissionCurrentReport
from app.vehicles.encoders import MissionSetCurrent, Outgoing
from app.vehicles.inbox import Inbox
from app.vehicles.settings import LinkSettings

_SHOWN_WITHIN_S: Final = 2.5
_SENDS: Final = 3


class CurrentItem:
    """Sets the current item. While holding it takes effect on resuming, and MISSION_CURRENT shows it only then."""

    def __init__(
        self, send: Callable[[Outgoing], None], sender: CommandSender, inbox: Inbox, settings: LinkSettings
    ) -> None:
        self._send = send
        self._sender = sender
        self._inbox = inbox
        self._settings = settings

    async def set(self, seq: int) -> None:
        """See VehicleLink.set_current."""
        request = command(
            MavCmd.DO_SET_MISSION_CURRENT,
            float(seq),
            0.0,  # keep the jump counters
            timeout_s=self._settings.command_timeout_s,
            attempts=self._settings.command_attempts,
        )
        ack = await self._sender.result(request)
        if ack.result is MavResult.UNSUPPORTED:
            await self._by_message(seq)
        elif ack.result is not MavResult.ACCEPTED:
            raise VehicleRefusedError(
                f"the vehicle refused to make item {seq} current: {ack.word}", result=ack.word, item_seq=seq
            )

    async def _by_message(self, seq: int) -> None:
        """MISSION_SET_CURRENT has no ack: sent until MISSION_CURRENT shows the item."""
        shown = asyncio.Event()

        def look(message: MissionCurrentReport, _received_s: float) -> None:
            if message.seq == seq:
                shown.set()

        end = self._inbox.on(MissionCurrentReport, look)
        try:
            for _ in range(_SENDS):
                self._send(MissionSetCurrent(seq))
                try:
                    async with asyncio.timeout(_SHOWN_WITHIN_S):
                        await shown.wait()
                except TimeoutError:
                    continue
                return
        finally:
            end()
        raise LinkTimeoutError(f"the vehicle does not show item {seq} as current", item_seq=seq)
