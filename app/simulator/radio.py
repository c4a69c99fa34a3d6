"""What one vehicle says: broadcasts, replies and status texts on all of its channels."""

from __future__ import annotations

from typing import Protocol

from app.simulator.dialect import Message, mavlink
from app.simulator.wire import VEHICLE_COMPONENT, Severity

TEXT_CHUNK_BYTES = 50


class Sender(Protocol):
    """A channel as the radio sees it."""

    gcs_seen: bool

    def send(self, message: Message, system_id: int, component_id: int) -> None: ...


class Radio:
    """The vehicle's voice. `system_id` is read at every message, because MAV_SYS_ID may change at a reboot."""

    def __init__(self, system_id: int) -> None:
        self.system_id = system_id
        self.channels: list[Sender] = []
        self.silent = False
        """Power is off (a reboot): nothing is sent."""
        self._text_id = 0

    def broadcast(self, message: Message, component_id: int = VEHICLE_COMPONENT) -> None:
        """Send on every channel."""
        for channel in self.channels:
            self.reply(channel, message, component_id)

    def reply(self, channel: Sender, message: Message, component_id: int = VEHICLE_COMPONENT) -> None:
        """Send on the channel a request came from."""
        if not self.silent:
            channel.send(message, self.system_id, component_id)

    def text(self, severity: Severity, text: str) -> None:
        """STATUSTEXT where a GCS heartbeat was seen; more than 50 bytes come in chunks with one id.

        PX4's texts end in a tab, which tells newer ground stations that an EVENT says the same.
        """
        listeners = [channel for channel in self.channels if channel.gcs_seen]
        if not listeners:
            return
        raw = (text + "\t").encode()
        self._text_id = (self._text_id + 1) % 65536
        for chunk in range((len(raw) + TEXT_CHUNK_BYTES - 1) // TEXT_CHUNK_BYTES):
            part = raw[chunk * TEXT_CHUNK_BYTES : (chunk + 1) * TEXT_CHUNK_BYTES]
            message = mavlink.MAVLink_statustext_message(severity, part, self._text_id, chunk)
            for channel in listeners:
                self.reply(channel, message)
