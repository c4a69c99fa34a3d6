"""What one vehicle says: broadcasts, replies and status texts on all of its channels."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.wire import VEHICLE_COMPONENT, Severity

TEXT_CHUNK_BYTES = 50
CONNECTED_S = 2.5
"""A link counts as connected so long after a GCS heartbeat (wall time)."""
STALE_S = 5.0
"""A text waits so long for a link to be connected [03_upload_bad, 24_link_loss]."""
TEXTS_KEPT = 8


class Sender(Protocol):
    """A channel as the radio sees it."""

    gcs_heard_s: float | None
    """Vehicle time of the newest GCS heartbeat on it; None before the first."""

    def send(self, message: Message, system_id: int, component_id: int) -> None: ...


class Radio:
    """The vehicle's voice. `system_id` is read at every message, because MAV_SYS_ID may change at a reboot."""

    def __init__(self, system_id: int, clock: VehicleClock) -> None:
        self.system_id = system_id
        self._clock = clock
        clock.on_speed(self._change_speed)
        self.channels: list[Sender] = []
        self.silent = False
        """Power is off (a reboot): nothing is sent."""
        self._text_id = 0
        self._texts: deque[tuple[float, Severity, str]] = deque(maxlen=TEXTS_KEPT)

    @property
    def _connected_s(self) -> float:
        """CONNECTED_S of wall time, in vehicle time."""
        return CONNECTED_S * self._clock.speed

    def _change_speed(self, factor: float) -> None:
        for channel in self.channels:
            if channel.gcs_heard_s is not None:
                channel.gcs_heard_s = self._clock.same_by_the_wall(channel.gcs_heard_s, factor)

    def boot(self) -> None:
        """Power-up: nothing has been said, and no ground station heard."""
        self.silent = False
        self._texts.clear()
        for channel in self.channels:
            channel.gcs_heard_s = None

    def broadcast(self, message: Message, component_id: int = VEHICLE_COMPONENT) -> None:
        """Send on every channel."""
        for channel in self.channels:
            self.reply(channel, message, component_id)

    def reply(self, channel: Sender, message: Message, component_id: int = VEHICLE_COMPONENT) -> None:
        """Send on the channel a request came from."""
        if not self.silent:
            channel.send(message, self.system_id, component_id)

    def on_gcs_heartbeat(self, channel: Sender) -> None:
        """A ground station lives on this channel; if it is new there, it hears what was said a moment ago."""
        now_s = self._clock.now_s
        heard_s, connected = channel.gcs_heard_s, self._connected(channel)
        channel.gcs_heard_s = now_s
        if connected:
            return
        unheard_s = now_s - STALE_S if heard_s is None else max(now_s - STALE_S, heard_s + self._connected_s)
        for said_s, severity, text in self._texts:
            if said_s > unheard_s:
                self._send_text([channel], severity, text)

    def _connected(self, channel: Sender) -> bool:
        heard_s = channel.gcs_heard_s
        return heard_s is not None and self._clock.now_s - heard_s <= self._connected_s

    def text(self, severity: Severity, text: str) -> None:
        """STATUSTEXT where a GCS heartbeat was heard lately; elsewhere it waits a little for one."""
        self._texts.append((self._clock.now_s, severity, text))
        self._send_text([channel for channel in self.channels if self._connected(channel)], severity, text)

    def _send_text(self, listeners: list[Sender], severity: Severity, text: str) -> None:
        """More than 50 bytes come in chunks with one id.

        PX4's texts end in a tab, which tells newer ground stations that an EVENT says the same.
        """
        if not listeners:
            return
        raw = (text + "\t").encode()
        self._text_id = (self._text_id + 1) % 65536
        for chunk in range((len(raw) + TEXT_CHUNK_BYTES - 1) // TEXT_CHUNK_BYTES):
            part = raw[chunk * TEXT_CHUNK_BYTES : (chunk + 1) * TEXT_CHUNK_BYTES]
            message = mavlink.MAVLink_statustext_message(severity, part, self._text_id, chunk)
            for channel in listeners:
                self.reply(channel, message)
