"""Commands and their acks: COMMAND_LONG or COMMAND_INT out, COMMAND_ACK back, one of one id at a time per vehicle.

mavlink_direct's own send_command gives only the final ack and never counts the confirmation up, so it is not used.
"""

from __future__ import annotations

import asyncio
import time
from collections import defaultdict
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing
from typing import Final

from app.domain.errors import CommandExpiredError, ConflictError, LinkError, LinkTimeoutError, VehicleRefusedError
from app.domain.mission import NAN, MavCmd
from app.domain.vehicle.commands import CommandAck, CommandRequest, MavResult, PendingCommand, is_late
from app.domain.vehicle.state import FlightMode
from app.vehicles.decoders import CommandAckReport, MissionCurrentReport
from app.vehicles.encoders import CommandInt, CommandLong, MissionSetCurrent, Outgoing
from app.vehicles.event_reasons import Topic
from app.vehicles.inbox import Inbox
from app.vehicles.native import OUR_COMPONENT_ID
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

_ACKS_WAITING: Final = 32
_UNKNOWN_PROGRESS: Final = 255


class CommandSender:
    """Sends commands to one vehicle. An ack is ours only if it is addressed to us and names the command."""

    def __init__(self, send: Callable[[Outgoing], None], inbox: Inbox, texts: StatusTexts, own_system_id: int) -> None:
        self._send = send
        self._own_system_id = own_system_id
        self._texts = texts
        self._waiting: dict[int, asyncio.Queue[CommandAck | None]] = {}
        self._turns: defaultdict[int, asyncio.Lock] = defaultdict(asyncio.Lock)
        self._closed = False
        inbox.on(CommandAckReport, self._take)

    async def acks(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        """Send and yield each ack; the last is final.

        Raises:
            ConflictError: the same command is under way. It is not queued: a release must not be sent later.
            CommandExpiredError: `send_before_s` is over; nothing was sent.
            LinkTimeoutError: no final ack before the deadline.
        """
        turn = self._turns[request.command]
        if turn.locked():
            raise ConflictError(
                f"{_name(request.command)} is already in progress", hint="wait for its final acknowledgement"
            )
        async with turn, aclosing(self._acks(request)) as acks:
            async for ack in acks:
                yield ack

    async def result(self, request: CommandRequest, on_sent: Callable[[], None] = lambda: None) -> CommandAck:
        """Wait for the turn, send, and return the final ack whatever it says. Raises LinkTimeoutError.

        `on_sent` is called as soon as the command is sent, nothing awaited in between.
        """
        async with self._turns[request.command], aclosing(self._acks(request, on_sent)) as acks:
            async for ack in acks:
                final = ack
            return final

    async def accepted(
        self,
        request: CommandRequest,
        what: str,
        *,
        text_window_s: float,
        mode: FlightMode | None = None,
        on_sent: Callable[[], None] = lambda: None,
    ) -> None:
        """Send and return when ACCEPTED; `on_sent` as of `result`. `mode`: the checks that fail for it are told too.

        Raises:
            VehicleRefusedError: any other final ack; `extra` has the result and the vehicle's texts.
            LinkTimeoutError: no final ack.
        """
        since_s = time.monotonic()
        ack = await self.result(request, on_sent)
        if ack.result is MavResult.ACCEPTED:
            return
        but = None if mode is None else Topic.HEALTH  # of those, only what fails for the mode
        texts = await self._texts.await_reasons(since_s, window_s=text_window_s, but=but)
        if mode is not None:
            texts = tuple(dict.fromkeys((*texts, *self._texts.failing_checks(mode))))
        raise VehicleRefusedError(
            f"the vehicle refused to {what}: {ack.word}" + "".join(f"; {text}" for text in texts),
            hint="see its texts" if texts else "",
            command=int(request.command),
            result=ack.word,
            result_code=ack.result_code,
            texts=texts,
        )

    def reasons_since(self, since_s: float) -> tuple[str, ...]:
        """The vehicle's texts since then (monotonic) that may say why it did not do what it acknowledged."""
        return self._texts.reasons_since(since_s, but=Topic.HEALTH)

    def close(self) -> None:
        """End all waits with LinkError. Idempotent."""
        self._closed = True
        for queue in self._waiting.values():
            _put(queue, None)

    async def _acks(
        self, request: CommandRequest, on_sent: Callable[[], None] = lambda: None
    ) -> AsyncGenerator[CommandAck, None]:
        if self._closed:
            raise LinkError("the link is closed")
        if request.send_before_s is not None and time.monotonic() >= request.send_before_s:
            raise CommandExpiredError(f"{_name(request.command)} was not sent: its time limit had passed")
        queue: asyncio.Queue[CommandAck | None] = asyncio.Queue(_ACKS_WAITING)
        self._waiting[request.command] = queue  # before sending: the ack may come within 0.1 ms
        try:
            pending = PendingCommand.sent(request, time.monotonic())
            self._send(_encoded(request, confirmation=0))
            on_sent()
            while not pending.is_over:
                ack = await _next(queue, pending.deadline_s)
                if ack is None:
                    pending, again = pending.ticked(time.monotonic())
                    if again:
                        self._send(_encoded(request, confirmation=pending.sends - 1))
                else:
                    pending = pending.acked(ack, time.monotonic())
                    yield ack
        finally:
            del self._waiting[request.command]
        if pending.timed_out:
            sends = request.sent_before + pending.sends
            unanswered = f"{sends} attempt{'' if sends == 1 else 's'} without an answer"
            after = "after IN_PROGRESS" if pending.in_progress else unanswered
            raise LinkTimeoutError(
                f"no final acknowledgement of {_name(request.command)}: {after}",
                hint="it is unknown what the vehicle did: check its state",
                command=int(request.command),
            )

    def _take(self, ack: CommandAckReport, _received_s: float) -> None:
        if (ack.target_system, ack.target_component) != (self._own_system_id, OUR_COMPONENT_ID):
            return
        queue = self._waiting.get(ack.command)
        if queue is not None:
            progress = None if ack.progress == _UNKNOWN_PROGRESS else ack.progress
            _put(queue, CommandAck(command=ack.command, result_code=ack.result, progress=progress))


def command(command: MavCmd, *params: float, timeout_s: float = 1.0, attempts: int = 3) -> CommandRequest:
    """A request with the given first params and NaN for the rest."""
    p1, p2, p3, p4, p5, p6, p7 = (*params, *[NAN] * (7 - len(params)))
    return CommandRequest(command, (p1, p2, p3, p4, p5, p6, p7), timeout_s=timeout_s, attempts=attempts)


def _encoded(request: CommandRequest, *, confirmation: int) -> CommandLong | CommandInt:
    if request.place is not None:
        return CommandInt(int(request.command), request.params[:4], *request.place, z=request.params[6])
    return CommandLong(int(request.command), request.params, confirmation=min(confirmation, 255))


def _name(number: int) -> str:
    return MavCmd(number).name


def _put(queue: asyncio.Queue[CommandAck | None], ack: CommandAck | None) -> None:
    if queue.full():
        queue.get_nowait()  # progress that nobody read; the newest counts
    queue.put_nowait(ack)


async def _next(queue: asyncio.Queue[CommandAck | None], deadline_s: float) -> CommandAck | None:
    """The next ack, or None at the deadline. Raises LinkError when the link is closed."""
    try:
        async with asyncio.timeout(deadline_s - time.monotonic()):
            ack = await queue.get()
    except TimeoutError:
        return None
    if ack is None:
        raise LinkError("the link was closed before the final acknowledgement")
    return ack


# Making a mission item current: command 224, and MISSION_SET_CURRENT for firmware that does not know it.


_SHOWN_WITHIN_S: Final = 2.5
_SENDS: Final = 3


class CurrentItem:
    """Sets the current item. While holding it takes effect on resuming, and MISSION_CURRENT shows it only then."""

    def __init__(
        self, send: Callable[[Outgoing], None], sender: CommandSender, inbox: Inbox, settings: LinkSettings
    ) -> None:
        self._send = send
        self._sender = sender
        self._inbox = inbox
        self._settings = settings

    async def set(self, seq: int) -> None:
        request = command(
            MavCmd.DO_SET_MISSION_CURRENT,
            float(seq),
            0.0,  # keep the jump counters
            timeout_s=self._settings.command_timeout_s,
            attempts=self._settings.command_attempts,
        )
        due_s = time.monotonic() + request.timeout_s * request.attempts
        ack = await self._sender.result(request)
        if ack.result is MavResult.UNSUPPORTED:
            await self._by_message(seq, due_s)
        elif ack.result is not MavResult.ACCEPTED:
            raise VehicleRefusedError(
                f"the vehicle refused to make item {seq} current: {ack.word}", result=ack.word, item_seq=seq
            )

    async def _by_message(self, seq: int, due_s: float) -> None:
        """MISSION_SET_CURRENT has no ack: sent until MISSION_CURRENT shows the item, but never late."""
        shown = asyncio.Event()

        def look(message: MissionCurrentReport, _received_s: float) -> None:
            if message.seq == seq:
                shown.set()

        end = self._inbox.on(MissionCurrentReport, look)
        try:
            for _ in range(_SENDS):
                if is_late(due_s, time.monotonic()):
                    break
                due_s = time.monotonic() + _SHOWN_WITHIN_S
                self._send(MissionSetCurrent(seq))
                try:
                    async with asyncio.timeout(_SHOWN_WITHIN_S):
                        await shown.wait()
                except TimeoutError:
                    continue
                return
        finally:
            end()
        raise LinkTimeoutError(f"the vehicle does not report item {seq} as current", item_seq=seq)
