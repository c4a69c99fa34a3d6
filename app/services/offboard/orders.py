"""Flying by commands: one order at a time, awaited by its ack; the newest wanted one is next, never a queue."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import aclosing
from dataclasses import dataclass, replace
from typing import Final

from app.domain.commands import CommandRequest, MavResult
from app.domain.errors import LinkError, LinkTimeoutError, VehicleRefusedError, WaydropError
from app.domain.mission import NAN, MavCmd
from app.domain.ports import VehicleLink
from app.domain.setpoint.capability import FlightKind
from app.domain.tasks.order_request import CIRCLE_HERE
from app.services.clock import Clock
from app.services.offboard_view import OrderView

EVERY_S: Final = 0.3
SET_MODE: Final = CommandRequest(MavCmd.DO_SET_MODE, (NAN, NAN, NAN, NAN, NAN, NAN, NAN))
UNANSWERED: Final = 3
"""So many in a row without an ack, and the vehicle is not ours any more."""


@dataclass(frozen=True, slots=True)
class Given:
    """An order that was sent, and how it was answered."""

    request: CommandRequest
    sent_s: float
    result: str = "sent"


class Orders:
    """All of it runs on the event loop. `changed` is called when an order was answered.

    `gone_s`: who guides must say what it wants at least so often.
    """

    def __init__(self, link: VehicleLink, clock: Clock, gone_s: float, changed: Callable[[], None]) -> None:
        self._link = link
        self._clock = clock
        self._gone_s = gone_s
        self._changed = changed
        self._wanted: CommandRequest | None = None
        self._wanted_s = 0.0
        self._given: Given | None = None
        self._unanswered = 0
        self._sending: asyncio.Task[None] | None = None
        self.refused = ""
        """Why the newest order was not accepted, in words."""

    def want(self, request: CommandRequest) -> None:
        """This is to hold now. Said at every tick: who falls silent has nothing guided."""
        if request != self._wanted:
            self._wanted, self.refused = request, ""
        self._wanted_s = self._clock.monotonic()

    def tick(self, now_s: float, kind: FlightKind) -> str:
        """Send what is wanted and does not hold yet. Why nothing may be ordered any more, in words, else empty."""
        if kind is not FlightKind.WING:
            return "it hovers now, and was flown by commands as a wing"
        if self._wanted is None:
            return ""
        if now_s - self._wanted_s > self._gone_s:
            return f"nothing was guided for {now_s - self._wanted_s:.1f} s: no fresh position, or no room to circle"
        if self._unanswered >= UNANSWERED:
            return f"{UNANSWERED} commands in a row were not answered"
        if self._is_due(self._wanted, now_s):
            self._sending = asyncio.create_task(self._deliver(self._wanted), name="flight order")
        return ""

    async def circle_here(self) -> None:
        """Nothing that was wanted before is sent any more; the vehicle circles where it is.

        Raises:
            VehicleRefusedError, LinkError: not confirmed. The vehicle may fly on to its last place and circle there.
        """
        sending = self._sending
        self.forget()
        if sending is not None:
            await asyncio.wait({sending})
        await self._send(CIRCLE_HERE)

    async def switch(self, switching: Awaitable[None]) -> None:
        """A change of mode: shown with its answer like any order. Raises what it raises."""
        self._given = Given(SET_MODE, self._clock.monotonic())
        try:
            await switching
        except LinkError as error:
            unseen = "ACCEPTED, not seen" if "mode" in error.extra else "no answer"
            self._given = replace(self._given, result=str(error.extra.get("result", unseen)))
            raise
        self._given = replace(self._given, result=MavResult.ACCEPTED.name)

    def forget(self) -> None:
        """Nothing is wanted any more, and no ack awaited."""
        self._wanted, self._unanswered, self.refused = None, 0, ""
        if self._sending is not None:
            self._sending.cancel()
            self._sending = None

    def view(self, now_s: float) -> OrderView | None:
        """The newest order and its answer."""
        if self._given is None:
            return None
        request = self._given.request
        place = request.place
        return OrderView(
            command=request.command.name,
            latitude_deg=None if place is None else place[0] / 1e7,
            longitude_deg=None if place is None else place[1] / 1e7,
            altitude_m=None if place is None else round(request.params[6], 2),
            radius_m=request.params[0] if request.command is MavCmd.DO_ORBIT else None,
            result=self._given.result,
            age_s=round(now_s - self._given.sent_s, 3),
        )

    def _is_due(self, wanted: CommandRequest, now_s: float) -> bool:
        if self._sending is not None or self.refused:
            return False
        given = self._given
        if given is None:
            return True
        holds = given.request == wanted and given.result == MavResult.ACCEPTED.name
        return not holds and now_s - given.sent_s >= EVERY_S

    async def _deliver(self, request: CommandRequest) -> None:
        try:
            await self._send(request)
        except LinkTimeoutError:
            self._unanswered += 1
        except WaydropError as error:
            if request == self._wanted:
                self.refused = error.detail
        else:
            self._unanswered = 0
        self._sending = None
        self._changed()

    async def _send(self, request: CommandRequest) -> None:
        """Return when it is accepted. Raises VehicleRefusedError, LinkError."""
        self._given = Given(request, self._clock.monotonic())
        try:
            async with aclosing(self._link.command(request)) as acks:
                async for ack in acks:
                    self._given = replace(self._given, result=ack.word)
                    final = ack
        except LinkTimeoutError:
            self._given = replace(self._given, result="no answer")
            raise
        if not final.is_final:
            raise LinkError(f"the acks of {request.command.name} ended without a final one")
        if final.result is not MavResult.ACCEPTED:
            raise VehicleRefusedError(f"{request.command.name} was answered {final.word}", result=final.word)
