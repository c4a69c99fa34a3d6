"""Control by commands: one pending command at a time, until its acknowledgement; then the newest one, never a queue."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import aclosing
from dataclasses import dataclass
from typing import Final

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import ConflictError, LinkError, LinkTimeoutError, VehicleRefusedError, WaydropError
from app.domain.mission import NAN, MavCmd
from app.domain.offboard.state import who_acts
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.commands import CommandRequest, MavResult
from app.services.clock import Clock
from app.services.vehicle_commands import circle_here
from app.services.views import SentCommandOutcome, SentCommandView

SET_MODE: Final = CommandRequest(MavCmd.DO_SET_MODE, (NAN, NAN, NAN, NAN, NAN, NAN, NAN))

MOST_UNANSWERED: Final = 4
"""This many commands without an answer are remembered; acknowledgements of older ones do not arrive any more."""


@dataclass(slots=True, eq=False)
class SentCommand:
    """A command that was sent, and its answer: an answer belongs to one transmission and to no later one."""

    request: CommandRequest
    sent_s: float
    outcome: SentCommandOutcome = "sent"
    result: MavResult | None = None

    def acknowledged(self, result: MavResult | None) -> None:
        """A COMMAND_ACK came; None: with a result that MAVLink does not name."""
        self.outcome, self.result = "acknowledged", result

    def unanswered(self, outcome: SentCommandOutcome) -> None:
        """No COMMAND_ACK reported its result."""
        self.outcome = outcome


class CommandDelivery:
    """All of it runs on the event loop."""

    def __init__(self, link: VehicleLink, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._turn = asyncio.Lock()
        self._newest: SentCommand | None = None
        self._without_answer: deque[CommandRequest] = deque(maxlen=MOST_UNANSWERED)

    async def send(self, request: CommandRequest) -> None:
        """Wait for its turn, send, and return when it is accepted.

        A COMMAND_ACK names the command and not the request: a late one would count as the answer to the next command of
        the same kind. So for each earlier one without an answer it is sent, and must be answered, once more.

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
            others = [one for one in self._without_answer if one.command is not request.command]
            self._without_answer = deque(others, maxlen=MOST_UNANSWERED)

    async def switch(self, switching: Awaitable[None]) -> None:
        """A change of mode: shown with its answer like any command. Raises what it raises."""
        sent = self._begin(SET_MODE)
        try:
            await switching
        except LinkError as error:
            if "result" in error.extra:
                sent.acknowledged(MavResult.__members__.get(str(error.extra["result"])))
            else:
                sent.unanswered("not_seen" if "mode" in error.extra else "unanswered")
            raise
        sent.acknowledged(MavResult.ACCEPTED)

    def since_s(self, now_s: float) -> float | None:
        """How long ago the newest was sent, in seconds."""
        return None if self._newest is None else now_s - self._newest.sent_s

    def view(self, now_s: float) -> SentCommandView | None:
        """The newest command and its answer."""
        if self._newest is None:
            return None
        request = self._newest.request
        place = request.place
        return SentCommandView(
            command=request.command.name,
            latitude_deg=None if place is None else place[0] / 1e7,
            longitude_deg=None if place is None else place[1] / 1e7,
            altitude_m=None if place is None else round(request.params[6], 2),
            radius_m=request.params[0] if request.command is MavCmd.DO_ORBIT else None,
            outcome=self._newest.outcome,
            result=self._newest.result,
            age_s=round(now_s - self._newest.sent_s, 3),
        )

    def _may_still_be_answered(self, request: CommandRequest) -> int:
        return sum(one.command is request.command and one != request for one in self._without_answer)

    def _begin(self, request: CommandRequest) -> SentCommand:
        self._newest = sent = SentCommand(request, self._clock.monotonic())
        return sent

    async def _send(self, request: CommandRequest) -> None:
        if who_acts(self._link.state()):
            raise LinkError(
                f"{request.command.name} was not sent: a failsafe is active, or somebody else controls the vehicle"
            )
        sent, final = self._begin(request), None
        self._without_answer.append(request)
        try:
            async with aclosing(self._link.command(request)) as acks:
                async for ack in acks:
                    sent.acknowledged(ack.result)
                    final = ack
        except ConflictError:
            self._without_answer.remove(request)
            sent.unanswered("not_sent")
            raise
        except LinkTimeoutError:
            sent.unanswered("unanswered")
            raise
        if final is None or not final.is_final:
            raise LinkError(f"{request.command.name} was never finally acknowledged")
        self._without_answer.remove(request)
        if final.result is not MavResult.ACCEPTED:
            raise VehicleRefusedError(
                f"the vehicle answered {request.command.name} with {final.word}", result=final.word
            )


EVERY_S: Final = 0.3
HEARTBEAT_FRESH_S: Final = 0.3
"""A command changes the mode to Hold, also from a pilot's mode: it is only sent this soon after a HEARTBEAT that
reports Hold.
"""
NO_TASK: Final = "no task gave one"
REFUSALS: Final = 3
"""After this many failures in a row of a repeated command, control by commands is over."""
UNANSWERED: Final = 3
"""So many in a row without an ack, and the vehicle is not ours any more."""


class CommandQueue:
    """Runs on the event loop. `changed` is called when a command was answered.

    `gone_s`: the guidance must call `want` at least this often.
    """

    def __init__(self, link: VehicleLink, clock: Clock, gone_s: float, changed: Callable[[], None]) -> None:
        self._link = link
        self._clock = clock
        self._gone_s = gone_s
        self._changed = changed
        self._delivery = CommandDelivery(link, clock)
        self._wanted: CommandRequest | None = None
        self._wanted_s = 0.0
        self._unguided = NO_TASK
        self._holds: CommandRequest | None = None
        self._unanswered = self._refusals = 0
        self._sending: asyncio.Task[None] | None = None
        self.refused = ""
        """Why the newest command was rejected, as text."""

    def want(self, request: CommandRequest) -> None:
        """Request this command. Called at every tick: without calls nothing is sent."""
        if request != self._wanted:
            self._wanted, self.refused, self._refusals = request, "", 0
        self._wanted_s, self._unguided = self._clock.monotonic(), NO_TASK

    def note(self, error: WaydropError) -> None:
        """Why the guidance wants none now."""
        self._unguided = error.detail

    def ask_again(self) -> None:
        """Repeat a rejected command: for a circle there is no alternative."""
        if self._refusals < REFUSALS:
            self.refused = ""

    def allow_again(self) -> None:
        """Allow a rejected command again: another task begins."""
        self.refused = ""

    def tick(self, now_s: float, kind: FlightKind) -> Reason | None:
        """Send the requested command if it is not active yet. Returns why no more commands are possible, else empty."""
        if kind is not FlightKind.WING:
            return Reason.of(ReasonCode.OFFBOARD_HOVERS)
        if self._wanted is None:
            return None
        if now_s - self._wanted_s > self._gone_s:
            silent_s, detail = now_s - self._wanted_s, self._unguided
            return Reason.of(ReasonCode.OFFBOARD_NOT_GUIDED, silent_s=silent_s, detail=detail)
        if self._unanswered >= UNANSWERED:
            return Reason.of(ReasonCode.OFFBOARD_UNANSWERED, count=UNANSWERED)
        if self._refusals >= REFUSALS:
            return Reason.of(ReasonCode.OFFBOARD_REFUSED, count=self._refusals, detail=self.refused)
        if self._is_due(self._wanted, now_s):
            self._sending = asyncio.create_task(self._deliver(self._wanted), name="offboard command")
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
        """A change of mode: shown with its answer like any command. Raises what it raises."""
        await self._delivery.switch(switching)

    def forget(self) -> None:
        """Drop the requested and the pending command: somebody else commands the vehicle next."""
        self._wanted, self._holds, self.refused = None, None, ""
        self._unanswered = self._refusals = 0
        if self._sending is not None:
            self._sending.cancel()

    def view(self, now_s: float) -> SentCommandView | None:
        """The newest command and its answer."""
        return self._delivery.view(now_s)

    def _is_due(self, wanted: CommandRequest, now_s: float) -> bool:
        if self._sending is not None or self.refused or self._holds == wanted:
            return False
        since_s = self._delivery.since_s(now_s)
        if since_s is not None and since_s < EVERY_S:
            return False
        state = self._link.state()
        return state.heartbeat_age_s is not None and state.heartbeat_age_s <= HEARTBEAT_FRESH_S and not who_acts(state)

    async def _deliver(self, request: CommandRequest) -> None:
        self._holds = None
        try:
            await self._delivery.send(request)
        except LinkTimeoutError:
            self._unanswered += 1
        except ConflictError:
            return  # somebody else's command of the same kind is pending: nothing was sent, it is retried
        except WaydropError as error:
            if request == self._wanted:
                self.refused, self._refusals = error.detail, self._refusals + 1
        else:
            self._unanswered, self._refusals, self._holds = 0, 0, request

    def _sent(self, _task: asyncio.Task[None]) -> None:
        self._sending = None
        self._changed()
