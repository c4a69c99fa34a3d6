"""The moment in which a vehicle says that it is disarmed: what only a disarmed one may be told leaves right after it.

HEARTBEAT comes at 1 Hz, and PX4 takes a mode from anybody and answers the arming of an armed vehicle with ACCEPTED.
"""

from __future__ import annotations

import asyncio
from typing import Final

from app.domain.arming import armed_by_others, disarmed_by_others
from app.domain.errors import CommandExpiredError
from app.domain.vehicle import FlightMode
from app.vehicles.decoders import Heartbeat
from app.vehicles.flown_by import flight_mode
from app.vehicles.inbox import Inbox

_ARMED: Final = 0x80
_LEAVES_WITHIN_S: Final = 0.3
"""Who arms meanwhile has not taken off yet: PX4 spools motors up for longer."""


async def heard_disarmed(inbox: Inbox, within_s: float, *, mode: FlightMode | None = None) -> float:
    """Return with the next HEARTBEAT: until when (monotonic) a command after it may leave.

    With `mode`, with the next one in that mode: one that was under way may be of the mode before.

    Raises:
        VehicleTakenError: it says armed, or another mode for so long. CommandExpiredError: none came.
    """
    first: asyncio.Future[tuple[Heartbeat, float]] = asyncio.get_running_loop().create_future()
    others: list[FlightMode] = []

    def take(message: Heartbeat, received_s: float) -> None:
        seen = flight_mode(message.custom_mode, message)
        if mode not in (None, seen) and not message.base_mode & _ARMED:
            others[:] = [seen]
        elif not first.done():
            first.set_result((message, received_s))

    end = inbox.on(Heartbeat, take)
    try:
        async with asyncio.timeout(within_s):
            beat, received_s = await first
    except TimeoutError as error:
        if others:
            raise disarmed_by_others(others[0]) from error
        raise CommandExpiredError(f"nothing was sent: no HEARTBEAT within {within_s:g} s") from error
    finally:
        end()
    if beat.base_mode & _ARMED:
        raise armed_by_others("the vehicle", flight_mode(beat.custom_mode, beat))
    return received_s + _LEAVES_WITHIN_S
