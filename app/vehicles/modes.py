"""Flight modes on the wire: commanded with DO_SET_MODE and then observed, because an ack alone proves nothing."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from app.domain.autopilot import autopilot, autopilot_kind
from app.domain.errors import CommandExpiredError, LinkError, LinkTimeoutError, VehicleRefusedError
from app.domain.flight.modes import armed_by_others, disarmed_by_others, taken_meanwhile
from app.domain.mission import MavCmd
from app.domain.vehicle.commands import is_late
from app.domain.vehicle.state import AutopilotKind, FlightMode, vehicle_type
from app.vehicles.command_sender import CommandSender, command
from app.vehicles.decoders import CurrentMode, Heartbeat
from app.vehicles.inbox import Inbox
from app.vehicles.settings import LinkSettings


def autopilot_of(beat: Heartbeat | None) -> AutopilotKind:
    """PX4 until a HEARTBEAT says who it is: of any other that Waydrop does not know nothing else is heard."""
    return (None if beat is None else autopilot_kind(beat.autopilot)) or AutopilotKind.PX4


def flight_mode(number: int, beat: Heartbeat | None) -> FlightMode:
    """The mode of a custom_mode."""
    return autopilot(autopilot_of(beat)).flight_mode(number, None if beat is None else vehicle_type(beat.type))


def mode_numbers(mode: FlightMode, beat: Heartbeat | None) -> tuple[int, int]:
    """DO_SET_MODE's param2 and param3 of a mode that Waydrop commands."""
    return autopilot(autopilot_of(beat)).mode_numbers(mode, None if beat is None else vehicle_type(beat.type))


# The moment in which a vehicle says that it is disarmed: what may only be sent to a disarmed one leaves right after it.
#
# HEARTBEAT comes at 1 Hz, and PX4 takes a mode from anybody and answers the arming of an armed vehicle with ACCEPTED.


_ARMED: Final = 0x80
_LEAVES_WITHIN_S: Final = 0.3
"""Who arms meanwhile has not taken off yet: PX4 spools motors up for longer."""


async def until_disarmed(inbox: Inbox, within_s: float, *, mode: FlightMode | None = None) -> float:
    """Return with the next HEARTBEAT: until when (monotonic) a command after it may leave.

    With `mode`, with the next one in that mode: one that was under way may be of the mode before.

    Raises:
        VehicleTakenError: it says armed, or another mode for so long. CommandExpiredError: none came.
    """
    first: asyncio.Future[tuple[Heartbeat, float]] = asyncio.get_running_loop().create_future()
    others: list[FlightMode] = []

    def take(message: Heartbeat, received_s: float) -> None:
        seen = flight_mode(message.custom_mode, message)
        if mode not in (None, seen) and not message.base_mode & _ARMED:
            others[:] = [seen]
        elif not first.done():
            first.set_result((message, received_s))

    end = inbox.on(Heartbeat, take)
    try:
        async with asyncio.timeout(within_s):
            beat, received_s = await first
    except TimeoutError as error:
        if others:
            raise disarmed_by_others(others[0]) from error
        raise CommandExpiredError(f"not sent: no HEARTBEAT within {within_s:g} s") from error
    finally:
        end()
    if beat.base_mode & _ARMED:
        raise armed_by_others("the vehicle", flight_mode(beat.custom_mode, beat))
    return received_s + _LEAVES_WITHIN_S


_CUSTOM_MODE_ENABLED: Final = 1


class ModeSwitch:
    """Commands modes with DO_SET_MODE and waits until they are seen: an ack alone does not say that a mode holds."""

    def __init__(
        self, sender: CommandSender, inbox: Inbox, settings: LinkSettings, mode: Callable[[], FlightMode | None]
    ) -> None:
        self._sender = sender
        self._inbox = inbox
        self._settings = settings
        self._mode = mode
        self._beat: Heartbeat | None = None
        inbox.on(Heartbeat, self._heard)

    def _heard(self, message: Heartbeat, _received_s: float) -> None:
        self._beat = message

    async def to(self, mode: FlightMode, *, until_seen: bool = False) -> None:
        """Command `mode` and return when a HEARTBEAT or CURRENT_MODE shows it.

        It is commanded again while nobody answers, unless it is late; `until_seen`: also while it is acknowledged and
        not seen. If the vehicle is in a third mode by then (Hold apart, into which PX4 goes by itself) somebody else
        has it.

        Raises:
            VehicleRefusedError: the vehicle cannot enter the mode; `extra` has its texts.
            VehicleTakenError: a pilot, another ground station or a failsafe chose another mode meanwhile.
            LinkTimeoutError: no ack, or acknowledged and then not seen.
        """
        before = self._mode()
        with self._watching(mode) as seen:
            for left in reversed(range(self._settings.command_attempts)):
                due_s = time.monotonic() + self._settings.command_timeout_s
                try:
                    await self._accepted(mode, attempts=1)
                except LinkTimeoutError:
                    if not seen.is_set() and (not left or is_late(due_s, time.monotonic())):
                        raise
                else:
                    due_s += self._settings.mode_again_s
                    if not (left and until_seen) or await self._is_seen(seen) or is_late(due_s, time.monotonic()):
                        break
                if seen.is_set():
                    break
                if before is not None and (now := self._mode()) not in (before, mode, FlightMode.HOLD):
                    raise taken_meanwhile(now)
            await self._until(seen, mode)

    async def through_hold_to(self, mode: FlightMode) -> None:
        """As `to`, with Hold asked for before: PX4 goes back to the mode before Return or Land when it disarms
        [recordings 26, 26b]. Not waited for: the vehicle must not stay in Hold, nor be kept from coming down.
        """
        is_unanswered = False
        try:
            await self._accepted(FlightMode.HOLD, attempts=1)
        except LinkTimeoutError:
            is_unanswered = True
        except LinkError:
            pass  # refused: the mode that is wanted may be taken all the same
        try:
            await self.to(mode, until_seen=True)  # an ack may be the late one of Hold
        except VehicleRefusedError:
            if not is_unanswered:
                raise
            await self.to(mode, until_seen=True)

    async def to_hold_disarmed(self) -> None:
        """Hold for a vehicle that stands disarmed: each attempt leaves right after a HEARTBEAT that says so.

        Raises:
            VehicleTakenError: it says armed; CommandExpiredError: it says nothing. VehicleRefusedError and
            LinkTimeoutError as `to`.
        """
        mode = FlightMode.HOLD
        with self._watching(mode) as seen:
            for left in reversed(range(self._settings.command_attempts)):
                send_before_s = await until_disarmed(self._inbox, self._settings.mode_seen_timeout_s)
                try:
                    await self._accepted(mode, attempts=1, send_before_s=send_before_s)
                    break
                except (LinkTimeoutError, CommandExpiredError):
                    if not left:
                        raise
            await self._until(seen, mode)

    async def _accepted(self, mode: FlightMode, *, attempts: int, send_before_s: float | None = None) -> None:
        main, sub = mode_numbers(mode, self._beat)
        request = command(
            MavCmd.DO_SET_MODE,
            _CUSTOM_MODE_ENABLED,
            main,
            sub,
            timeout_s=self._settings.command_timeout_s,
            attempts=attempts,
        )
        await self._sender.accepted(
            replace(request, send_before_s=send_before_s),
            f"enter {mode.value} mode",
            text_window_s=self._settings.refusal_text_window_s,
        )

    async def _is_seen(self, seen: asyncio.Event) -> bool:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(self._settings.mode_again_s):
                await seen.wait()
        return seen.is_set()

    async def _until(self, seen: asyncio.Event, mode: FlightMode) -> None:
        try:
            async with asyncio.timeout(self._settings.mode_seen_timeout_s):
                await seen.wait()
        except TimeoutError as error:
            raise LinkTimeoutError(
                f"{mode.value} mode was acknowledged but not reported within {self._settings.mode_seen_timeout_s:g} s",
                hint="the vehicle may have left it again: check its mode and status texts",
                mode=mode.value,
            ) from error

    @contextmanager
    def _watching(self, mode: FlightMode) -> Iterator[asyncio.Event]:
        """An event that is set while the newest sign is of `mode`; watched from before the command, or the first is
        missed. One that was under way then may be of a mode that the vehicle has left since.
        """
        seen, since_s = asyncio.Event(), time.monotonic()

        def look(message: Heartbeat | CurrentMode, received_s: float) -> None:
            if received_s < since_s:
                return
            if flight_mode(message.custom_mode, self._beat) is mode:
                seen.set()
            else:
                seen.clear()

        ends = (self._inbox.on(Heartbeat, look), self._inbox.on(CurrentMode, look))
        try:
            yield seen
        finally:
            for end in ends:
                end()
