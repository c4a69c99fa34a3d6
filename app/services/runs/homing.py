"""The return of a rover to where it took off: PX4 moves home of a rover to the place where its return begins."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from contextlib import aclosing
from typing import Final

import structlog

from app.domain.errors import WaydropError
from app.domain.events.run import CommandOutcome, RunAck, RunCommand, RunCommandName, answer
from app.domain.geo import distance_m
from app.domain.mission import NAN, MavCmd
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.commands import CommandRequest, MavResult
from app.domain.vehicle.state import GlobalPosition, VehicleType

log = structlog.get_logger(__name__)
MOVED_M: Final = 1.0
"""PX4 moves home a little as it arms."""
TAKEN_OVER_S: Final = 0.1
"""PX4's navigator reads home in its next cycle, a twentieth of a second later."""
_HERE: Final = CommandRequest(MavCmd.DO_SET_HOME, (1.0, NAN, NAN, NAN, NAN, NAN, NAN), timeout_s=0.5, attempts=2)
"""PX4 keeps a home that was given until a reboot, also when the rover is armed elsewhere. This one it moves again."""


class HomeReturn:
    """Commands Return; of a rover whose home has moved it first sets home back. A return is never held up by that: what
    fails is recorded, and Return is commanded all the same.

    `home` is that of the takeoff, None if it is not known. `may_have_moved`: although it is not told yet.
    """

    def __init__(
        self,
        link: VehicleLink,
        record: Callable[[RunCommand | RunAck], None],
        home: Callable[[], GlobalPosition | None],
        may_have_moved: Callable[[], bool],
    ) -> None:
        self._link = link
        self._record = record
        self._home = home
        self._may_have_moved = may_have_moved
        self._is_set = False

    async def order(self) -> None:
        """Return, confirmed. Raises LinkError."""
        home = self._moved_from
        if home is not None and await self._send(_home_at(home)):
            self._is_set = True
            await asyncio.sleep(TAKEN_OVER_S)
        await self._link.return_to_launch()
        if self._is_set and await self._send(_HERE):  # PX4 chose where to go as the return began
            self._is_set = False

    @property
    def _moved_from(self) -> GlobalPosition | None:
        """Home of the takeoff, if the vehicle has another one now, or may have: it is told once a second."""
        home, now = self._home(), self._link.state().home
        if self._link.identity.vehicle_type is not VehicleType.ROVER or home is None or now is None:
            return None
        away_m = distance_m(home.latitude_deg, home.longitude_deg, now.latitude_deg, now.longitude_deg)
        return home if away_m > MOVED_M or self._may_have_moved() else None

    async def _send(self, request: CommandRequest) -> bool:
        """Whether it was accepted. Stored with what follows: a disk that hangs must not hold up a return."""
        name, is_accepted = RunCommandName.DO_SET_HOME, False
        params = tuple(None if math.isnan(p) else p for p in request.params)
        self._record(RunCommand(command=name, params=params))
        try:
            async with aclosing(self._link.command(request)) as acks:
                async for ack in acks:
                    self._record(answer(name, ack))
                    is_accepted = ack.result is MavResult.ACCEPTED
        except WaydropError as error:
            self._record(RunAck(command=name, outcome=CommandOutcome.FAILED, detail=error.detail))
        if not is_accepted:
            system_id = self._link.identity.system_id
            log.warning("home was not set: the rover may return elsewhere", system_id=system_id, params=params)
        return is_accepted


def _home_at(home: GlobalPosition) -> CommandRequest:
    place = (round(home.latitude_deg * 1e7), round(home.longitude_deg * 1e7))
    params = (0.0, NAN, NAN, NAN, home.latitude_deg, home.longitude_deg, home.altitude_m)
    return CommandRequest(MavCmd.DO_SET_HOME, params, timeout_s=0.5, attempts=2, place=place)
