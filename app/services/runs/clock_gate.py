"""Before a start: a vehicle whose clock runs too fast for supervised drops does not take off with one."""

from __future__ import annotations

import asyncio
from typing import Final

from app.domain.errors import ConflictError
from app.domain.live_control import TOO_FAST_HINT, is_too_fast, needs_longer_look, too_fast_words
from app.domain.mission import Mission
from app.domain.ports import VehicleLink
from app.services.clock import Clock

LONGEST_LOOK_S: Final = 12.0
LOOK_EVERY_S: Final = 0.1
LONGEST_UNMEASURED_S: Final = 1.5
"""A vehicle that was just found is measured within about a second. One that sends no positions does not wait here."""


async def refuse_fast_clock(link: VehicleLink, mission: Mission, clock: Clock) -> None:
    """Raises ConflictError. Returns at once for a real vehicle heard for a second, or without supervised drops.

    The plan's check (`vehicle.clock_too_fast`) says the same earlier, but a vehicle that was just found has not been
    listened to for long then.
    """
    if not any(drop.supervised for drop in mission.drops):
        return
    began_s = clock.monotonic()
    while True:
        heard, waited_s = link.state().clock, clock.monotonic() - began_s
        undecided = needs_longer_look(heard) if heard.is_measured else waited_s < LONGEST_UNMEASURED_S
        if not undecided or waited_s >= LONGEST_LOOK_S:
            break
        await asyncio.sleep(LOOK_EVERY_S)
    least_rate = heard.least_rate
    if least_rate is not None and is_too_fast(least_rate):
        raise ConflictError(too_fast_words(least_rate), hint=TOO_FAST_HINT)
