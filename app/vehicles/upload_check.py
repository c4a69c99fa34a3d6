"""Whether the vehicle holds what was sent: by the id it gives the list, else by reading it back."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from app.domain.errors import LinkError
from app.domain.mission import MissionItem, MissionType
from app.vehicles.decoders import MissionCurrentReport
from app.vehicles.inbox import Inbox
from app.vehicles.list_transfer import ListTransfer
from app.vehicles.mission_checksum import mission_checksum
from app.vehicles.mission_wire import first_difference, from_wire, to_wire

_REPORT_WITHIN_S: Final = 2.2
"""MISSION_CURRENT comes every second; one may be lost."""
_READ_BACK_ATTEMPTS: Final = 3
UNREACHABLE: Final = "the link is lost: whether the vehicle holds the list is not known"


@dataclass(frozen=True, slots=True)
class Verdict:
    """`verified_by` is "mission_id" or "read_back"; None if the vehicle does not hold the list, `problem` says why."""

    verified_by: str | None
    mission_id: int | None
    problem: str = ""


class UploadCheck:
    """Compares what was sent with what the vehicle says it holds."""

    def __init__(self, inbox: Inbox, lists: ListTransfer, is_connected: Callable[[], bool]) -> None:
        self._inbox = inbox
        self._is_connected = is_connected
        self._lists = lists

    async def after_ack(self, mission_type: MissionType, items: Sequence[MissionItem], opaque_id: int) -> Verdict:
        """The vehicle accepted the upload and named it `opaque_id` (0: this firmware names none)."""
        if opaque_id and opaque_id == mission_checksum(to_wire(items)):
            return Verdict("mission_id", opaque_id)
        return await self._read_back(mission_type, items, opaque_id or None)

    async def without_ack(self, mission_type: MissionType, items: Sequence[MissionItem]) -> Verdict:
        """The final ack did not come: lost on its way, or the transfer really broke off."""
        if not self._is_connected():
            return Verdict(None, None, UNREACHABLE)
        await self._lists.end_open_transfer(mission_type)
        wanted = mission_checksum(to_wire(items))
        if await self._reported(mission_type, wanted):
            return Verdict("mission_id", wanted)
        return await self._read_back(mission_type, items, None)

    async def _read_back(
        self, mission_type: MissionType, items: Sequence[MissionItem], mission_id: int | None
    ) -> Verdict:
        problem = ""
        for _ in range(_READ_BACK_ATTEMPTS):
            try:
                held = from_wire(await self._lists.download(mission_type, expected_items=len(items)))
            except LinkError as error:
                problem = error.detail
                if not self._is_connected():
                    return Verdict(None, None, UNREACHABLE)
                await self._lists.end_open_transfer(mission_type)
                continue
            seq = first_difference(items, held)
            if seq is None:
                return Verdict("read_back", mission_id)
            return Verdict(None, None, f"the vehicle holds {len(held)} of {len(items)} items, item {seq} differs")
        return Verdict(None, None, problem)

    async def _reported(self, mission_type: MissionType, wanted: int) -> bool:
        """Whether MISSION_CURRENT names this list soon. A firmware without ids (0) is not waited for."""
        since_s, answer = time.monotonic(), asyncio.Event()
        found = False

        def look(message: MissionCurrentReport, received_s: float) -> None:
            nonlocal found
            named = _id_of(message, mission_type)
            if received_s >= since_s and named in {wanted, 0}:
                found = named == wanted
                answer.set()

        end = self._inbox.on(MissionCurrentReport, look)
        try:
            async with asyncio.timeout(_REPORT_WITHIN_S):
                await answer.wait()
        except TimeoutError:
            return False
        finally:
            end()
        return found


def _id_of(message: MissionCurrentReport, mission_type: MissionType) -> int:
    return {
        MissionType.MISSION: message.mission_id,
        MissionType.FENCE: message.fence_id,
        MissionType.RALLY: message.rally_points_id,
    }[mission_type]
