"""How often a vehicle sends what Waydrop reads: set at the source, or 50 to 100 Hz streams would flood Python."""

from __future__ import annotations

from typing import Final

from app.domain.mission import MavCmd
from app.vehicles.command_sender import CommandSender, command
from app.vehicles.settings import LinkSettings

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
