"""Flight modes and arming on the wire: commanded and then observed, because an ack alone proves nothing."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from app.domain.autopilot import autopilot, autopilot_kind
from app.domain.errors import (
    CommandExpiredError,
    LinkError,
    LinkTimeoutError,
    VehicleRefusedError,
    VehicleTakenError,
)
from app.domain.flight.modes import armed_by_others, disarmed_by_others, disarmed_meanwhile, taken_meanwhile
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


_UNDER_WAY_S: Final = 0.5
"""A HEARTBEAT may be older than the arming that was acknowledged before it: PX4 publishes its state at 2 Hz or more."""


class Arming:
    """Arms and disarms with COMPONENT_ARM_DISARM."""

    def __init__(self, sender: CommandSender, inbox: Inbox, settings: LinkSettings) -> None:
        self._sender = sender
        self._inbox = inbox
        self._settings = settings

    async def arm(self, leaves: Callable[[], None]) -> None:
        """Arm a vehicle that stands disarmed in Hold; see VehicleLink. `leaves` is called when the command is sent."""
        send_before_s = await until_disarmed(self._inbox, self._settings.mode_seen_timeout_s, mode=FlightMode.HOLD)
        await self._accepted(armed=True, send_before_s=send_before_s, on_sent=leaves)

    async def until_armed(self) -> None:
        """Return with the next HEARTBEAT that says armed; see VehicleLink.wait_armed."""
        since_s = time.monotonic()
        first: asyncio.Future[Heartbeat] = asyncio.get_running_loop().create_future()

        def take(message: Heartbeat, received_s: float) -> None:
            says_armed = bool(message.base_mode & _ARMED)
            counts_from_s = since_s if says_armed else since_s + _UNDER_WAY_S
            if received_s >= counts_from_s and not first.done():
                first.set_result(message)

        end = self._inbox.on(Heartbeat, take)
        try:
            async with asyncio.timeout(self._settings.mode_seen_timeout_s):
                beat = await first
        except TimeoutError as error:
            raise LinkTimeoutError(
                f"arming was not confirmed: no HEARTBEAT within {self._settings.mode_seen_timeout_s:g} s",
                hint="see whether the vehicle is armed",
            ) from error
        finally:
            end()
        if not beat.base_mode & _ARMED:
            raise disarmed_meanwhile(flight_mode(beat.custom_mode, beat))

    async def disarm(self) -> None:
        """Disarm until HEARTBEAT shows it: an acknowledgement names no request, and may be that of an arming. It is
        commanded again unless it is late: after a standstill of this process somebody else may have armed the vehicle.

        Raises:
            VehicleRefusedError: it flies. LinkTimeoutError: no acknowledgement, or HEARTBEAT does not show it.
        """
        was_refused = False
        unanswered = 0
        for left in reversed(range(self._settings.command_attempts)):
            due_s = time.monotonic() + self._settings.command_timeout_s
            problem = await self._disarming_problem(unanswered)
            unanswered += isinstance(problem, LinkTimeoutError)
            is_shown = await self._is_disarmed()
            if is_shown and not (left and isinstance(problem, LinkTimeoutError)):
                return  # unanswered, that HEARTBEAT may have been under way before an arming
            is_refused = isinstance(problem, VehicleRefusedError)
            if not left or is_late(due_s, time.monotonic()) or (is_refused and was_refused):
                raise problem or LinkTimeoutError(
                    "disarming was acknowledged, and HEARTBEAT does not report it",
                    hint="see whether the vehicle is armed",
                )
            was_refused = is_refused

    async def _disarming_problem(self, sent_before: int) -> LinkError | None:
        """Command it once; what kept it from being accepted."""
        try:
            await self._accepted(armed=False, sent_before=sent_before)
        except (LinkTimeoutError, VehicleRefusedError) as error:
            return error
        return None

    async def _is_disarmed(self) -> bool:
        """Whether the next HEARTBEAT says so."""
        try:
            await until_disarmed(self._inbox, self._settings.mode_seen_timeout_s)
        except (VehicleTakenError, CommandExpiredError):
            return False
        return True

    async def _accepted(
        self,
        *,
        armed: bool,
        sent_before: int = 0,
        send_before_s: float | None = None,
        on_sent: Callable[[], None] = lambda: None,
    ) -> None:
        request = command(
            MavCmd.COMPONENT_ARM_DISARM,
            float(armed),
            0.0,
            timeout_s=self._settings.command_timeout_s,
            attempts=1,
        )
        await self._sender.accepted(
            replace(request, sent_before=sent_before, send_before_s=send_before_s),
            "arm" if armed else "disarm",
            text_window_s=self._settings.refusal_text_window_s,
            mode=FlightMode.HOLD if armed else None,
            on_sent=on_sent,
        )


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

    @property
    def _is_armed(self) -> bool:
        return self._beat is not None and bool(self._beat.base_mode & _ARMED)

    async def to(self, mode: FlightMode, *, until_seen: bool = False) -> None:
        """Command `mode` and return when a HEARTBEAT or CURRENT_MODE shows it.

        It is commanded again while nobody answers, unless it is late; `until_seen`: also while it is acknowledged and
        not seen. If the vehicle is in a third mode by then (Hold apart, into which PX4 goes by itself) somebody else
        has it; the same if it entered the mode and left it again. Hold alone is then commanded again. Mission is not
        commanded again once the vehicle is disarmed: it would take off as soon as somebody arms it.

        Raises:
            VehicleRefusedError: the vehicle cannot enter the mode; `extra` has its texts.
            VehicleTakenError: a pilot, another ground station or a failsafe chose another mode, or disarmed it.
            LinkTimeoutError: no ack, or acknowledged and then not seen.
        """
        before, was_armed, unanswered = self._mode(), self._is_armed, 0
        with self._watching(mode) as signs:
            for left in reversed(range(self._settings.command_attempts)):
                due_s = time.monotonic() + self._settings.command_timeout_s
                try:
                    await self._accepted(mode, sent_before=unanswered)
                except LinkTimeoutError:
                    unanswered += 1
                    if not signs.are_an_answer and (not left or is_late(due_s, time.monotonic())):
                        raise
                else:
                    signs.begin_anew()
                    due_s += self._settings.mode_again_s
                    again_s = self._settings.mode_again_s
                    if (
                        not (left and until_seen)
                        or await signs.seen_within(again_s)
                        or is_late(due_s, time.monotonic())
                    ):
                        break
                if signs.are_an_answer:
                    break
                if before is not None and (now := self._mode()) not in (before, mode, FlightMode.HOLD):
                    raise taken_meanwhile(now, self._sender.reasons_since(signs.since_s))
                if mode is FlightMode.MISSION and was_armed and not self._is_armed:
                    raise disarmed_meanwhile(self._mode(), self._sender.reasons_since(signs.since_s))
            await self._until(signs)

    async def through_hold_to(self, mode: FlightMode) -> None:
        """As `to`, with Hold asked for before: PX4 goes back to the mode before Return or Land when it disarms
        [recordings 26, 26b]. Not waited for: the vehicle must not stay in Hold, nor be kept from coming down.
        """
        is_unanswered = False
        try:
            await self._accepted(FlightMode.HOLD)
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
        unanswered = 0
        with self._watching(mode) as signs:
            for left in reversed(range(self._settings.command_attempts)):
                send_before_s = await until_disarmed(self._inbox, self._settings.mode_seen_timeout_s)
                if unanswered and signs.are_an_answer:
                    break
                try:
                    await self._accepted(mode, sent_before=unanswered, send_before_s=send_before_s)
                    signs.begin_anew()
                    break
                except (LinkTimeoutError, CommandExpiredError) as error:
                    unanswered += isinstance(error, LinkTimeoutError)
                    if not left and not (unanswered and signs.are_an_answer):
                        raise
            await self._until(signs)

    async def _accepted(self, mode: FlightMode, *, sent_before: int = 0, send_before_s: float | None = None) -> None:
        main, sub = mode_numbers(mode, self._beat)
        request = command(
            MavCmd.DO_SET_MODE,
            _CUSTOM_MODE_ENABLED,
            main,
            sub,
            timeout_s=self._settings.command_timeout_s,
            attempts=1,
        )
        await self._sender.accepted(
            replace(request, sent_before=sent_before, send_before_s=send_before_s),
            f"enter {mode.value} mode",
            text_window_s=self._settings.refusal_text_window_s,
            mode=mode,
        )

    async def _until(self, signs: _Signs) -> None:
        if await signs.seen_within(self._settings.mode_seen_timeout_s):
            return
        texts = self._sender.reasons_since(signs.since_s)
        if signs.has_come and (now := self._mode()) is not None:
            raise taken_meanwhile(now, texts)
        raise LinkTimeoutError(
            f"{signs.mode.value} mode was acknowledged but not reported within "
            f"{self._settings.mode_seen_timeout_s:g} s" + "".join(f"; {text}" for text in texts),
            hint="the vehicle may have left it again: check its mode and status texts",
            mode=signs.mode.value,
            texts=texts,
        )

    @contextmanager
    def _watching(self, mode: FlightMode) -> Iterator[_Signs]:
        """Signs of `mode`, watched from before the command, or the first one is missed."""
        since_s = time.monotonic()
        signs = _Signs(mode, since_s)

        def look(message: Heartbeat | CurrentMode, received_s: float) -> None:
            if received_s >= since_s:
                signs.take(flight_mode(message.custom_mode, self._beat))

        ends = (self._inbox.on(Heartbeat, look), self._inbox.on(CurrentMode, look))
        try:
            yield signs
        finally:
            for end in ends:
                end()


class _Signs:
    """Of a commanded mode: HEARTBEAT and CURRENT_MODE.

    It is seen when it is the newest, or has come since the acknowledgement. One from before may have been under way
    when the mode was commanded, of a vehicle that has left it since.
    """

    def __init__(self, mode: FlightMode, since_s: float) -> None:
        self.mode = mode
        self.since_s = since_s
        self.is_newest = False
        self.has_come = False
        self._is_acknowledged = False
        self._came = asyncio.Event()

    def take(self, shown: FlightMode) -> None:
        """One more sign."""
        self.is_newest = shown is self.mode
        if self.is_newest:
            self.has_come = True
            self._came.set()

    def begin_anew(self) -> None:
        """The command is acknowledged."""
        self.has_come, self._is_acknowledged = False, True

    @property
    def are_an_answer(self) -> bool:
        """The vehicle has entered the mode, though it acknowledged nothing. If it has left it since, perhaps for
        somebody else, only Hold is worth another command.
        """
        return self.is_newest or (self.has_come and self.mode is not FlightMode.HOLD)

    async def seen_within(self, timeout_s: float) -> bool:
        """Whether the mode is seen by then."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout_s):
                while not self._is_seen:
                    self._came.clear()
                    await self._came.wait()
        return self._is_seen

    @property
    def _is_seen(self) -> bool:
        return self.is_newest or (self._is_acknowledged and self.has_come)
