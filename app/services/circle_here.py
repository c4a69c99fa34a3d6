"""The last word to a wing in Hold: circle here. It is never said to a vehicle that somebody else has."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Final

from app.domain.commands import CommandRequest
from app.domain.errors import LinkError, LinkTimeoutError
from app.domain.offboard.modes import who_acts
from app.domain.ports import VehicleLink
from app.domain.tasks.order_request import CIRCLE_HERE

ATTEMPTS: Final = 3


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
