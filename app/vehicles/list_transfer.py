"""Reading a list of mission items back, and clearing one. The caller holds the vehicle's mission lock."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Final

from app.domain.errors import LinkError, LinkTimeoutError, VehicleRefusedError
from app.domain.mission import MissionType
from app.domain.vehicle.commands import is_late
from app.vehicles.decoders import MissionAck
from app.vehicles.encoders import MissionAckOut, MissionClearAll, Outgoing
from app.vehicles.inbox import Inbox
from app.vehicles.mission_wire import MissionResult, WireItem, result_word
from app.vehicles.native import NativeSystem, settle_from_thread
from app.vehicles.settings import LinkSettings

_PER_ITEM_S: Final = 0.5
_CLEAR_TIMEOUTS_S: Final = (0.35, *[0.7] * 8)
"""Of each attempt. PX4 keeps a transfer that another station left open for 5 s and ignores a clear meanwhile."""
_CANCEL_SETTLES_S: Final = 0.05


class ListTransfer:
    """Downloads and clears."""

    def __init__(
        self, system: NativeSystem, send: Callable[[Outgoing], None], inbox: Inbox, settings: LinkSettings
    ) -> None:
        self._system = system
        self._send = send
        self._inbox = inbox
        self._settings = settings

    async def download(self, mission_type: MissionType, *, expected_items: int) -> list[WireItem]:
        """The list as the vehicle holds it. `expected_items` only sets how long to wait.

        Raises:
            LinkTimeoutError: no whole list came.
            LinkError: mavsdk could not download; `extra` has its result.
        """
        done: asyncio.Future[tuple[str, list[WireItem]]] = asyncio.get_running_loop().create_future()
        self._system.download(mission_type, lambda result, items: settle_from_thread(done, (result, items)))
        try:
            async with asyncio.timeout(self._settings.transfer_silence_s + _PER_ITEM_S * expected_items):
                result, items = await asyncio.shield(done)
        except TimeoutError:
            result, items = "TIMEOUT", []
        finally:
            if not done.done():
                self._system.cancel_transfers()
                await asyncio.wait({done}, timeout=self._settings.close_timeout_s)
        if result == "SUCCESS":
            return items
        error = LinkTimeoutError if result == "TIMEOUT" else LinkError
        raise error(f"the {mission_type.name.lower()} list could not be read back: {result}", result=result)

    async def clear(self, mission_type: MissionType) -> None:
        """Empty one list; asked again, but never late. Raises LinkTimeoutError, or VehicleRefusedError with the
        MAV_MISSION_RESULT.
        """
        acks: asyncio.Queue[MissionAck] = asyncio.Queue(8)
        own_id = self._settings.own_system_id

        def take(message: MissionAck, _received_s: float) -> None:
            if message.mission_type == mission_type and message.target_system == own_id and not acks.full():
                acks.put_nowait(message)

        end = self._inbox.on(MissionAck, take)
        try:
            due_s = time.monotonic()
            for timeout_s in _CLEAR_TIMEOUTS_S:
                if is_late(due_s, time.monotonic()):
                    break
                due_s = time.monotonic() + timeout_s + _CANCEL_SETTLES_S
                self._send(MissionClearAll(mission_type))
                ack = await _next(acks, timeout_s)
                if ack is not None and ack.type == MissionResult.ACCEPTED:
                    return
                if ack is not None and ack.type != MissionResult.ERROR:
                    word = result_word(ack.type)
                    raise VehicleRefusedError(
                        f"the vehicle did not clear its {_name(mission_type)}: {word}", result=word
                    )
                await self.end_open_transfer(mission_type)
        finally:
            end()
        raise LinkTimeoutError(
            f"no answer to the request to clear the {_name(mission_type)}", mission_type=_name(mission_type)
        )

    async def end_open_transfer(self, mission_type: MissionType) -> None:
        """End a transfer that the vehicle may still wait in; PX4 takes a new one 50 ms later."""
        self._send(MissionAckOut(mission_type))
        await asyncio.sleep(_CANCEL_SETTLES_S)


def _name(mission_type: MissionType) -> str:
    return mission_type.name.lower()


async def _next(acks: asyncio.Queue[MissionAck], timeout_s: float) -> MissionAck | None:
    try:
        async with asyncio.timeout(timeout_s):
            return await acks.get()
    except TimeoutError:
        return None
