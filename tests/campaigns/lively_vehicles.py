"""Scripted vehicles that live: they take off, advance, land, lose their link and refuse, at random."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Sequence
from typing import Final

from app.domain.errors import LinkTimeoutError, VehicleRefusedError
from app.domain.vehicle.state import FlightMode, LandedState, MissionState
from tests.support.fake_links import HOME, FakeLink

PERIOD_S: Final = 0.05
AIRBORNE: Final = {"armed": True, "landed": LandedState.IN_AIR, "relative_altitude_m": 15.0}
LANDED: Final = {
    "armed": False,
    "landed": LandedState.ON_GROUND,
    "relative_altitude_m": 0.0,
    "mode": FlightMode.HOLD,
}


async def live(links: Sequence[FakeLink], chance: random.Random) -> None:
    """Until it is cancelled: something happens to one of them, again and again."""
    while True:
        await asyncio.sleep(PERIOD_S)
        link = chance.choice(links)
        link.refusal = None
        if not link.state().connected:
            link.change(connected=True)
            continue
        match chance.randrange(10):
            case 0 | 1 | 2:
                last = max(0, (link.state().mission_total or 1) - 1)
                link.change(mission_seq=min(last, (link.state().mission_seq or 0) + 1))
            case 3 | 4:
                link.change(**LANDED, mission_state=MissionState.COMPLETE)
            case 5:
                link.change(**AIRBORNE, absolute_altitude_m=HOME.altitude_m + 15.0)
            case 6:
                link.change(mode=chance.choice([FlightMode.HOLD, FlightMode.RETURN, FlightMode.POSITION]))
            case 7:
                link.refusal = chance.choice([VehicleRefusedError("denied"), LinkTimeoutError("no answer")])
            case 8:
                link.change(connected=False)
            case _:
                link.change(battery_percent=float(chance.randrange(5, 100)))
