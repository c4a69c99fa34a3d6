"""Flight modes: commanded with DO_SET_MODE and then seen, because an ack alone does not say that the mode holds."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from app.domain.arming import armed_by_others
from app.domain.errors import CommandExpiredError, LinkError, LinkTimeoutError
from app.domain.mission import MavCmd
from app.domain.vehicle import FlightMode
from app.vehicles.command_sender import CommandSender, command
from app.vehicles.custom_mode import COMMANDED, flight_mode
from app.vehicles.decoders import CurrentMode, Heartbeat
from app.vehicles.inbox import Inbox
from app.vehicles.settings import LinkSettings

_CUSTOM_MODE_ENABLED: Final = 1
_ARMED: Final = 0x80
_LEAVES_WITHIN_S: Final = 0.3
"""After a HEARTBEAT that says disarmed. Who arms then has not taken off yet: PX4 spools motors up for longer."""


class ModeSwitch:
    """Switches modes of one vehicle."""

    def __init__(self, sender: CommandSender, inbox: Inbox, settings: LinkSettings) -> None:
        self._sender = sender
        self._inbox = inbox
        self._settings = settings

    async def to(self, mode: FlightMode) -> None:
        """Command `mode` and return when a HEARTBEAT or CURRENT_MODE shows it.

        Raises:
            VehicleRefusedError: the vehicle cannot enter the mode; `extra` has its texts.
            LinkTimeoutError: no ack, or acknowledged and then not seen.
        """
        with self._watching(mode) as seen:
            await self._accepted(mode, attempts=self._settings.command_attempts)
            await self._until(seen, mode)

    async def through_hold_to(self, mode: FlightMode) -> None:
        """As `to`, with Hold asked for before: PX4 goes back to the mode before Return or Land when it disarms
        [recordings 26, 26b]. Not waited for: the vehicle must not stay in Hold, nor be kept from coming down.
        """
        with contextlib.suppress(LinkError):
            await self._accepted(FlightMode.HOLD, attempts=1)
        await self.to(mode)

    async def to_hold_disarmed(self) -> None:
        """Hold for a vehicle that stands disarmed. PX4 takes a mode from anybody, armed or not, so each attempt leaves
        right after a HEARTBEAT that says disarmed.

        Raises:
            VehicleTakenError: it says armed; nothing was sent. VehicleRefusedError, LinkTimeoutError as `to`.
        """
        mode = FlightMode.HOLD
        with self._watching(mode) as seen:
            for left in reversed(range(self._settings.command_attempts)):
                heard_s = await self._heard_disarmed()
                try:
                    await self._accepted(mode, attempts=1, send_before_s=heard_s + _LEAVES_WITHIN_S)
                    break
                except (LinkTimeoutError, CommandExpiredError):
                    if not left:
                        raise
            await self._until(seen, mode)

    async def _accepted(self, mode: FlightMode, *, attempts: int, send_before_s: float | None = None) -> None:
        main, sub = COMMANDED[mode]
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

    async def _until(self, seen: asyncio.Event, mode: FlightMode) -> None:
        try:
            async with asyncio.timeout(self._settings.mode_seen_timeout_s):
                await seen.wait()
        except TimeoutError as error:
            raise LinkTimeoutError(
                f"{mode.value} mode was acknowledged but not seen within {self._settings.mode_seen_timeout_s:g} s",
                hint="the vehicle may have left it again: look at its mode and texts",
                mode=mode.value,
            ) from error

    async def _heard_disarmed(self) -> float:
        """Return with the next HEARTBEAT, when it was received. Raises VehicleTakenError, LinkTimeoutError."""
        beats: asyncio.Queue[tuple[Heartbeat, float]] = asyncio.Queue(1)

        def take(message: Heartbeat, received_s: float) -> None:
            if beats.empty():
                beats.put_nowait((message, received_s))

        end = self._inbox.on(Heartbeat, take)
        try:
            async with asyncio.timeout(self._settings.mode_seen_timeout_s):
                beat, received_s = await beats.get()
        except TimeoutError as error:
            raise LinkTimeoutError("no HEARTBEAT came to command Hold after", hint="look at the link") from error
        finally:
            end()
        if beat.base_mode & _ARMED:
            raise armed_by_others("the vehicle", flight_mode(beat.custom_mode))
        return received_s

    @contextmanager
    def _watching(self, mode: FlightMode) -> Iterator[asyncio.Event]:
        """An event that is set when `mode` is seen; watched from before the command, or the first sign is missed."""
        seen, since_s = asyncio.Event(), time.monotonic()

        def look(message: Heartbeat | CurrentMode, received_s: float) -> None:
            if received_s >= since_s and flight_mode(message.custom_mode) is mode:
                seen.set()

        ends = (self._inbox.on(Heartbeat, look), self._inbox.on(CurrentMode, look))
        try:
            yield seen
        finally:
            for end in ends:
                end()
