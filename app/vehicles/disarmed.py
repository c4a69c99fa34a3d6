"""The moment in which a vehicle says that it is disarmed: what only a disarmed one may be told leaves right after it.

HEARTBEAT comes at 1 Hz, and PX4 takes a mode from anybody and answers the arming of an armed vehicle with ACCEPTED.
"""

from __future__ import annotations

import asyncio
from typing import Final

from app.domain.arming import armed_by_others
from app.domain.errors import CommandExpiredError
from app.vehicles.custom_mode import flight_mode
from app.vehicles.decoders import Heartbeat
from app.vehicles.inbox import Inbox

_ARMED: Final = 0x80
_LEAVES_WITHIN_S: Final = 0.3
"""Who arms meanwhile has not taken off yet: PX4 spools motors up for longer."""


async def heard_disarmed(inbox: Inbox, within_s: float) -> float:
    """Return with the next HEARTBEAT: until when (monotonic) a command after it may leave.

    Raises:
        VehicleTakenError: it says armed. CommandExpiredError: none came.
    """
    beats: asyncio.Queue[tuple[Heartbeat, float]] = asyncio.Queue(1)

    def take(message: Heartbeat, received_s: float) -> None:
        if beats.empty():
            beats.put_nowait((message, received_s))

    end = inbox.on(Heartbeat, take)
    try:
        async with asyncio.timeout(within_s):
            beat, received_s = await beats.get()
    except TimeoutError as error:
        raise CommandExpiredError(f"nothing was sent: no HEARTBEAT within {within_s:g} s") from error
    finally:
        end()
    if beat.base_mode & _ARMED:
        raise armed_by_others("the vehicle", flight_mode(beat.custom_mode))
    return received_s + _LEAVES_WITHIN_S
