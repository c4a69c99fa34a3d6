"""What a link sets up when its vehicle appears, restarts or comes back, and how often it then sends what is read."""

from __future__ import annotations

import asyncio
import logging
from typing import Final

from app.domain.errors import LinkError, LinkTimeoutError, VehicleQuarantinedError
from app.domain.mission import MavCmd
from app.vehicles.command_sender import CommandSender, command
from app.vehicles.facts import FactReader
from app.vehicles.link_watch import LinkWatch
from app.vehicles.settings import LinkSettings

# How often a vehicle sends what Waydrop reads: set at the source, or 50 to 100 Hz streams would flood Python.


SERVO_OUTPUT_RAW: Final = 36
_GLOBAL_POSITION_INT: Final = 33
_EXTENDED_SYS_STATE: Final = 245
_GPS_RAW_INT: Final = 24
_CURRENT_MODE: Final = 436
_HOME_POSITION: Final = 242
_SYS_STATUS: Final = 1
_SYSTEM_TIME: Final = 2
_SLOW_HZ: Final = 1.0


class StreamRates:
    """Sets message intervals. A refusal is no error: older firmware lacks some of these streams."""

    def __init__(self, sender: CommandSender, settings: LinkSettings) -> None:
        self._sender = sender
        self._settings = settings

    async def set_all(self) -> None:
        """The streams that every link needs. Raises LinkTimeoutError."""
        for message_id, rate_hz in (
            (_GLOBAL_POSITION_INT, self._settings.position_rate_hz),
            (_EXTENDED_SYS_STATE, self._settings.slow_rate_hz),
            (_CURRENT_MODE, self._settings.slow_rate_hz),
            (_GPS_RAW_INT, _SLOW_HZ),
            (_HOME_POSITION, _SLOW_HZ),
            (_SYS_STATUS, _SLOW_HZ),
            (_SYSTEM_TIME, _SLOW_HZ),
        ):
            await self.set(message_id, rate_hz)

    async def set_servo_outputs(self) -> None:
        """The gripper's output is seen 10 times a second."""
        await self.set(SERVO_OUTPUT_RAW, self._settings.position_rate_hz)

    async def set(self, message_id: int, rate_hz: float) -> None:
        """One stream. Raises LinkTimeoutError."""
        interval_us = 1e6 / rate_hz
        await self._sender.result(
            command(
                MavCmd.SET_MESSAGE_INTERVAL,
                message_id,
                interval_us,
                timeout_s=self._settings.command_timeout_s,
                attempts=self._settings.command_attempts,
            )
        )


_AGAIN_AFTER_S: Final = 3.0
_log = logging.getLogger(__name__)


SET_UP_AT_ONCE: Final = 8
"""Vehicles. A hundred that are asked at once answer late, and are asked again before they have answered."""


class LinkSetup:
    """What a link does by itself when its vehicle appears, restarts or comes back: rates, facts, the gripper's channel.

    Runs in the background until it succeeded; a new beginning replaces the one under way.
    `turns` are shared by all vehicles of a process.
    """

    def __init__(self, rates: StreamRates, facts: FactReader, watch: LinkWatch, turns: asyncio.Semaphore) -> None:
        self._rates = rates
        self._facts = facts
        self._watch = watch
        self._turns = turns
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Do it all (again)."""
        if self._task is not None:
            self._task.cancel()
        self._task = asyncio.create_task(self._until_done(), name="link setup")

    def begin_after_silence(self) -> None:
        """What the vehicle announced meanwhile was not heard."""
        self._facts.doubt()
        self.begin()

    def look_at_gripper(self) -> None:
        """Parameters changed: the gripper may have another output now, or none."""
        channel, before = self._facts.gripper(), self._watch.gripper
        is_over = self._task is None or self._task.done()
        self._watch.look_at(channel, self._facts.has_gripper_output())
        if channel != before or (is_over and not self._facts.limits_read):
            self.begin()  # the limits of another output are read, and its stream asked for

    def begin_after_reboot(self) -> None:
        """The vehicle may have another firmware and other parameters now."""
        self._facts.forget()
        self._watch.look_at(None, None)
        self.begin()

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _until_done(self) -> None:
        while True:
            try:
                if not self._watch.lost:  # who is silent takes no turn from the others
                    async with self._turns:
                        await self._set_up()
                    return
            except VehicleQuarantinedError:
                return
            except LinkError as error:
                _log.info("link setup did not complete, retrying: %s", error.detail)
            await asyncio.sleep(_AGAIN_AFTER_S)

    async def _set_up(self) -> None:
        await self._rates.set_all()
        await self._facts.read()
        if not self._facts.limits_read:
            raise LinkTimeoutError("the limits of the gripper output have not been read yet")
        self._watch.look_at(self._facts.gripper(), self._facts.has_gripper_output())
        if self._watch.gripper is not None:
            await self._rates.set_servo_outputs()
