"""Who a vehicle is: AUTOPILOT_VERSION, asked for until it comes and again when two vehicles are suspected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from app.domain.mission import MavCmd
from app.domain.vehicle import FirmwareVersion
from app.vehicles.command_sender import command
from app.vehicles.decoders import AutopilotVersion
from app.vehicles.encoders import CommandLong, Outgoing
from app.vehicles.settings import LinkSettings

_AUTOPILOT_VERSION: Final = 148
_TWO_ANSWERS_S: Final = 5.0
"""Two different uids within so short a time are two vehicles; later it is another vehicle in the place of the first."""


class Identity:
    """Firmware and uid. Requests are sent without waiting: the acks of mavsdk's own requests look like ours."""

    def __init__(self, send: Callable[[Outgoing], None], settings: LinkSettings) -> None:
        self._send = send
        self._settings = settings
        self._asked_s: float | None = None
        self._heard_s: float | None = None
        self.firmware: FirmwareVersion | None = None
        self.uid: str | None = None
        self.known = False

    def ask(self, now_s: float) -> None:
        """Request AUTOPILOT_VERSION now."""
        self._asked_s = now_s
        request = command(MavCmd.REQUEST_MESSAGE, _AUTOPILOT_VERSION)
        self._send(CommandLong(int(request.command), request.params))

    def tick(self, now_s: float) -> None:
        """Ask again if it is time: often until the answer came, then now and then."""
        wait_s = self._settings.identity_recheck_s if self.known else self._settings.identity_retry_s
        if self._asked_s is None or now_s - self._asked_s >= wait_s:
            self.ask(now_s)

    def ask_soon(self, now_s: float) -> None:
        """Ask because of a suspicion, not more often than the retry time allows."""
        if self._asked_s is None or now_s - self._asked_s >= self._settings.identity_retry_s:
            self.ask(now_s)

    def forget_after_reboot(self) -> None:
        """Another firmware, or another vehicle, may answer next."""
        self._heard_s = self._asked_s = None
        self.known = False

    def take(self, message: AutopilotVersion, received_s: float) -> tuple[bool, str | None]:
        """An answer: whether something new is known, and the other uid if two vehicles answer."""
        uid, firmware = _uid(message), _firmware(message.flight_sw_version)
        recent = self._heard_s is not None and received_s - self._heard_s < _TWO_ANSWERS_S
        if recent and uid != self.uid and self.known:
            return False, uid or "none"
        news = not self.known or (uid, firmware) != (self.uid, self.firmware)
        self.uid, self.firmware, self.known, self._heard_s = uid, firmware, True, received_s
        return news, None


def _firmware(version: int) -> FirmwareVersion | None:
    if not version:
        return None
    return FirmwareVersion(version >> 24 & 0xFF, version >> 16 & 0xFF, version >> 8 & 0xFF)


def _uid(message: AutopilotVersion) -> str | None:
    if any(message.uid2):
        return bytes(message.uid2).hex()
    return f"{message.uid:016x}" if message.uid else None
