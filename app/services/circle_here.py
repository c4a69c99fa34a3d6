"""The last word to a wing in Hold: circle here. It is never said to a vehicle that somebody else has."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Final

from app.domain.commands import CommandRequest
from app.domain.errors import LinkError, LinkTimeoutError
from app.domain.ports import VehicleLink
from app.domain.reason import Reason, ReasonCode, because
from app.domain.tasks.order_request import CIRCLE_HERE
from app.domain.vehicle import FlightMode, VehicleState

ATTEMPTS: Final = 3


def who_acts(state: VehicleState) -> Reason | None:
    """Who else has a vehicle that was left in Hold; None if nobody. An unknown mode is nobody's."""
    if state.in_failsafe:
        return because(ReasonCode.OFFBOARD_FAILSAFE)
    if state.mode not in (FlightMode.HOLD, None):
        return because(ReasonCode.OFFBOARD_MODE_BY_OTHERS, mode=state.mode.value)
    return None


async def circle_here(link: VehicleLink, send: Callable[[CommandRequest], Awaitable[None]]) -> None:
    """Say it until it is heard, and look before each time: it changes the mode, so it would take the vehicle away.

    Raises:
        LinkError: not confirmed, or somebody else acts. VehicleRefusedError, ConflictError: what `send` raises.
    """
    for left in reversed(range(ATTEMPTS)):
        if who_acts(link.state()):
            raise LinkError("not told to circle here: a failsafe acts, or somebody else commanded another mode")
        try:
            await send(CIRCLE_HERE)
        except LinkTimeoutError:
            if not left:
                raise
        else:
            return
