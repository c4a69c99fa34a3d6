"""One order on the wire at a time, and the newest one with its answer."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable
from contextlib import aclosing
from dataclasses import dataclass
from typing import Final

from app.domain.commands import CommandRequest, MavResult
from app.domain.errors import ConflictError, LinkError, LinkTimeoutError, VehicleRefusedError
from app.domain.mission import NAN, MavCmd
from app.domain.offboard.modes import who_acts
from app.domain.ports import VehicleLink
from app.services.clock import Clock
from app.services.offboard_view import OrderView

SET_MODE: Final = CommandRequest(MavCmd.DO_SET_MODE, (NAN, NAN, NAN, NAN, NAN, NAN, NAN))

UNHEARD: Final = 4
"""So many orders without an answer are remembered; an ack of an older one does not come any more."""


@dataclass(slots=True, eq=False)
class Given:
    """An order that was sent, and how it was answered: an answer belongs to one sending and to no later one."""

    request: CommandRequest
    sent_s: float
    result: str = "sent"


class Delivery:
    """All of it runs on the event loop."""

    def __init__(self, link: VehicleLink, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._turn = asyncio.Lock()
        self._newest: Given | None = None
        self._unheard: deque[CommandRequest] = deque(maxlen=UNHEARD)

    async def send(self, request: CommandRequest) -> None:
        """Wait for the turn, send, and return when it is accepted.

        A COMMAND_ACK names its command and not the order: one that comes late would pass for the answer to the next
        order of the same kind. So for each earlier one without an answer it is sent, and must be answered, once more.

        Raises:
            VehicleRefusedError, LinkError, ConflictError: somebody else sends the same command to this vehicle.
        """
        async with self._turn:
            for doubts in reversed(range(1 + self._may_still_be_answered(request))):
                try:
                    await self._send(request)
                except VehicleRefusedError:
                    if not doubts:
                        raise
            others = [one for one in self._unheard if one.command is not request.command]
            self._unheard = deque(others, maxlen=UNHEARD)

    async def switch(self, switching: Awaitable[None]) -> None:
        """A change of mode: shown with its answer like any order. Raises what it raises."""
        given = self._begin(SET_MODE)
        try:
            await switching
        except LinkError as error:
            unseen = "ACCEPTED, not seen" if "mode" in error.extra else "no answer"
            given.result = str(error.extra.get("result", unseen))
            raise
        given.result = MavResult.ACCEPTED.name

    def since_s(self, now_s: float) -> float | None:
        """How long ago the newest was sent, in seconds."""
        return None if self._newest is None else now_s - self._newest.sent_s

    def view(self, now_s: float) -> OrderView | None:
        """The newest order and its answer."""
        if self._newest is None:
            return None
        request = self._newest.request
        place = request.place
        return OrderView(
            command=request.command.name,
            latitude_deg=None if place is None else place[0] / 1e7,
            longitude_deg=None if place is None else place[1] / 1e7,
            altitude_m=None if place is None else round(request.params[6], 2),
            radius_m=request.params[0] if request.command is MavCmd.DO_ORBIT else None,
            result=self._newest.result,
            age_s=round(now_s - self._newest.sent_s, 3),
        )

    def _may_still_be_answered(self, request: CommandRequest) -> int:
        return sum(one.command is request.command and one != request for one in self._unheard)

    def _begin(self, request: CommandRequest) -> Given:
        self._newest = given = Given(request, self._clock.monotonic())
        return given

    async def _send(self, request: CommandRequest) -> None:
        if who_acts(self._link.state()):
            raise LinkError(f"{request.command.name} was not sent: a failsafe acts, or somebody else has the vehicle")
        given, final = self._begin(request), None
        self._unheard.append(request)
        try:
            async with aclosing(self._link.command(request)) as acks:
                async for ack in acks:
                    given.result = ack.word
                    final = ack
        except ConflictError:
            self._unheard.remove(request)
            given.result = "not sent"
            raise
        except LinkTimeoutError:
            given.result = "no answer"
            raise
        if final is None or not final.is_final:
            raise LinkError(f"the acks of {request.command.name} ended without a final one")
        self._unheard.remove(request)
        if final.result is not MavResult.ACCEPTED:
            raise VehicleRefusedError(f"{request.command.name} was answered {final.word}", result=final.word)
