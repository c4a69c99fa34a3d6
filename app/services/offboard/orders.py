"""Flying by commands: one order at a time, awaited by its ack; the newest wanted one is next, never a queue."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Final

from app.domain.commands import CommandRequest
from app.domain.errors import ConflictError, LinkTimeoutError, WaydropError
from app.domain.offboard.modes import who_acts
from app.domain.ports import VehicleLink
from app.domain.reason import Reason, ReasonCode, because
from app.domain.setpoint.capability import FlightKind
from app.services.circle_here import circle_here
from app.services.clock import Clock
from app.services.offboard.delivery import Delivery
from app.services.offboard_view import OrderView

EVERY_S: Final = 0.3
HEARD_S: Final = 0.3
"""An order takes the vehicle to Hold, out of a pilot's mode too: it leaves so soon after a HEARTBEAT that says Hold."""
REFUSALS: Final = 3
"""So many in a row of an order that is asked for again, and nothing more can be done by orders."""
UNANSWERED: Final = 3
"""So many in a row without an ack, and the vehicle is not ours any more."""


class Orders:
    """All of it runs on the event loop. `changed` is called when an order was answered.

    `gone_s`: who guides must say what it wants at least so often.
    """

    def __init__(self, link: VehicleLink, clock: Clock, gone_s: float, changed: Callable[[], None]) -> None:
        self._link = link
        self._clock = clock
        self._gone_s = gone_s
        self._changed = changed
        self._delivery = Delivery(link, clock)
        self._wanted: CommandRequest | None = None
        self._wanted_s = 0.0
        self._holds: CommandRequest | None = None
        self._unanswered = self._refusals = 0
        self._sending: asyncio.Task[None] | None = None
        self.refused = ""
        """Why the newest order was not accepted, in words."""

    def want(self, request: CommandRequest) -> None:
        """This is to hold now. Said at every tick: who falls silent has nothing guided."""
        if request != self._wanted:
            self._wanted, self.refused, self._refusals = request, "", 0
        self._wanted_s = self._clock.monotonic()

    def ask_again(self) -> None:
        """What was refused is to hold all the same: for a circle there is nothing else to do instead."""
        if self._refusals < REFUSALS:
            self.refused = ""

    def tick(self, now_s: float, kind: FlightKind) -> Reason | None:
        """Send what is wanted and does not hold yet. Why nothing may be ordered any more, in words, else empty."""
        if kind is not FlightKind.WING:
            return because(ReasonCode.OFFBOARD_HOVERS)
        if self._wanted is None:
            return None
        if now_s - self._wanted_s > self._gone_s:
            return because(ReasonCode.OFFBOARD_NOT_GUIDED, silent_s=now_s - self._wanted_s)
        if self._unanswered >= UNANSWERED:
            return because(ReasonCode.OFFBOARD_UNANSWERED, count=UNANSWERED)
        if self._refusals >= REFUSALS:
            return because(ReasonCode.OFFBOARD_REFUSED, count=self._refusals, detail=self.refused)
        if self._is_due(self._wanted, now_s):
            self._sending = asyncio.create_task(self._deliver(self._wanted), name="flight order")
            self._sending.add_done_callback(self._sent)
        return None

    async def circle_here(self) -> None:
        """Nothing that was wanted before is sent any more; the vehicle circles where it is.

        Raises:
            VehicleRefusedError, LinkError: not confirmed. The vehicle may fly on to its last place and circle there.
        """
        self.forget()
        if self._sending is not None:
            await asyncio.wait({self._sending})
        await circle_here(self._link, self._delivery.send)

    async def switch(self, switching: Awaitable[None]) -> None:
        """A change of mode: shown with its answer like any order. Raises what it raises."""
        await self._delivery.switch(switching)

    def forget(self) -> None:
        """Nothing is wanted any more, and no ack awaited. It may hold no longer: somebody else speaks next."""
        self._wanted, self._holds, self.refused = None, None, ""
        self._unanswered = self._refusals = 0
        if self._sending is not None:
            self._sending.cancel()

    def view(self, now_s: float) -> OrderView | None:
        """The newest order and its answer."""
        return self._delivery.view(now_s)

    def _is_due(self, wanted: CommandRequest, now_s: float) -> bool:
        if self._sending is not None or self.refused or self._holds == wanted:
            return False
        since_s = self._delivery.since_s(now_s)
        if since_s is not None and since_s < EVERY_S:
            return False
        state = self._link.state()
        return state.heartbeat_age_s is not None and state.heartbeat_age_s <= HEARD_S and not who_acts(state)

    async def _deliver(self, request: CommandRequest) -> None:
        self._holds = None
        try:
            await self._delivery.send(request)
        except LinkTimeoutError:
            self._unanswered += 1
        except ConflictError:
            return  # somebody else's command of the same kind is under way: nothing was sent, it is tried again
        except WaydropError as error:
            if request == self._wanted:
                self.refused, self._refusals = error.detail, self._refusals + 1
        else:
            self._unanswered, self._refusals, self._holds = 0, 0, request

    def _sent(self, _task: asyncio.Task[None]) -> None:
        self._sending = None
        self._changed()
