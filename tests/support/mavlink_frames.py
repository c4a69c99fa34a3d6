"""Frames as pymavlink packs them: what a vehicle, a ground station or a forger may put on a link."""

from __future__ import annotations

import time
from typing import Final

from pymavlink.dialects.v20 import common as mavlink

MAV_TYPE_QUADROTOR: Final = 2
MAV_TYPE_GCS: Final = 6
EPOCH_S: Final = 1_420_070_400
"""MAVLink's timestamps count from 2015, in units of 10 us."""


def timestamp_of(unix_s: float) -> int:
    """A Unix time as MAVLink writes it."""
    return round((unix_s - EPOCH_S) * 1e5)


class FrameSender:
    """One component of one system. With a `key` it signs, from `timestamp` on (None: the time of now)."""

    def __init__(
        self,
        system: int = 1,
        component: int = 1,
        *,
        key: bytes | None = None,
        link_id: int = 0,
        timestamp: int | None = None,
    ) -> None:
        self._mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        if key is not None:
            self._mav.signing.secret_key = key
            self._mav.signing.sign_outgoing = True
            self._mav.signing.link_id = link_id
            self._mav.signing.timestamp = timestamp_of(time.time()) if timestamp is None else timestamp

    def pack(self, message: mavlink.MAVLink_message, *, mavlink1: bool = False) -> bytes:
        """Its next frame."""
        frame = bytes(message.pack(self._mav, force_mavlink1=mavlink1))
        self._mav.seq = (self._mav.seq + 1) % 256
        return frame

    def heartbeat(self, *, kind: int = MAV_TYPE_QUADROTOR, armed: bool = False, mavlink1: bool = False) -> bytes:
        """HEARTBEAT of a PX4 in Hold, or of a ground station."""
        base_mode = 29 | (128 if armed else 0)
        autopilot = 8 if kind == MAV_TYPE_GCS else 12
        hold = 4 << 16 | 3 << 24
        return self.pack(mavlink.MAVLink_heartbeat_message(kind, autopilot, base_mode, hold, 4, 3), mavlink1=mavlink1)

    def position(self, boot_ms: int = 5000) -> bytes:
        """GLOBAL_POSITION_INT."""
        return self.pack(mavlink.MAVLink_global_position_int_message(boot_ms, 1, 2, 3, 4, 5, 6, 7, 8))

    def attitude(self, boot_ms: int = 5000) -> bytes:
        """ATTITUDE. It passes the link guard however late it is read."""
        return self.pack(mavlink.MAVLink_attitude_message(boot_ms, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6))

    def text(self, text: str) -> bytes:
        """STATUSTEXT."""
        return self.pack(mavlink.MAVLink_statustext_message(6, text.encode(), 0, 0))

    def radio_status(self) -> bytes:
        """RADIO_STATUS."""
        return self.pack(mavlink.MAVLink_radio_status_message(190, 180, 90, 40, 38, 0, 0))

    def ping(self, target: int = 0) -> bytes:
        """PING to a system, or to everybody."""
        return self.pack(mavlink.MAVLink_ping_message(1, 1, target, target))

    def command(self, target: int, number: int, *params: float) -> bytes:
        """COMMAND_LONG to the autopilot of `target`."""
        given = (*params, *[0.0] * 7)[:7]
        return self.pack(mavlink.MAVLink_command_long_message(target, 1, number, 0, *given))
