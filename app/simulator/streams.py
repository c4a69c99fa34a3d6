"""Sends each message as often as its default rate says, or as a ground station has asked."""

from __future__ import annotations

import math
from collections.abc import Mapping

from app.simulator.channel import Radio
from app.simulator.clock import VehicleClock
from app.simulator.telemetry import Telemetry

# Which message goes out how often [Hz] by its id, until a ground station asks for other intervals.


ONBOARD_HZ: Mapping[int, float] = {
    0: 1.0,  # HEARTBEAT
    1: 2.0,  # SYS_STATUS
    24: 2.0,  # GPS_RAW_INT
    30: 10.0,  # ATTITUDE
    32: 4.0,  # LOCAL_POSITION_NED
    33: 10.0,  # GLOBAL_POSITION_INT
    36: 10.0,  # SERVO_OUTPUT_RAW
    74: 4.0,  # VFR_HUD
    141: 1.0,  # ALTITUDE
    147: 0.5,  # BATTERY_STATUS
    242: 0.5,  # HOME_POSITION
    245: 5.0,  # EXTENDED_SYS_STATE
    360: 1.0,  # ORBIT_EXECUTION_STATUS, while there is an orbit
    436: 0.5,  # CURRENT_MODE
}
"""As PX4's onboard link, the fast ones at 10 Hz."""
LOW_HZ: Mapping[int, float] = {
    0: 1.0,
    1: 0.5,
    24: 0.5,
    30: 0.5,
    33: 4.0,
    36: 0.5,
    74: 0.5,
    242: 0.25,
    245: 1.0,
    436: 0.25,
}
"""With MISSION_CURRENT, which comes once a second anyhow, ten messages a second."""
RATES: Mapping[str, Mapping[int, float]] = {"onboard": ONBOARD_HZ, "low": LOW_HZ}


FIRST_S: dict[int, float] = {0: 1.2, 33: 1.5, 32: 1.5, 436: 2.2, 242: 2.32}
"""Vehicle time of a message's first sending; the others start with the link."""
LINK_UP_S = 0.25
FASTEST_WALL_HZ = 25.0
"""At high speed factors a stream is thinned to this many a second of wall time."""


class Streams:
    """Sends what is due. `default_hz` by message id."""

    def __init__(
        self, telemetry: Telemetry, radio: Radio, clock: VehicleClock, default_hz: Mapping[int, float]
    ) -> None:
        self._default_hz = {number: hz for number, hz in default_hz.items() if number in telemetry.builders}
        self._telemetry = telemetry
        self._radio = radio
        self._clock = clock
        self._interval_s: dict[int, float] = {}
        self._due_s: dict[int, float] = {}
        self.boot()
        clock.on_speed(self._change_speed)

    def boot(self) -> None:
        """Power-up: default rates again."""
        self._interval_s = {message_id: 1.0 / hz for message_id, hz in self._default_hz.items()}
        self._due_s = {message_id: FIRST_S.get(message_id, LINK_UP_S) for message_id in self._default_hz}
        self._next_s = 0.0
        """Nothing is due before."""

    def step(self) -> None:
        """Send the messages whose time has come."""
        now_s = self._clock.now_s
        if now_s < self._next_s:
            return
        fastest_s = self._fastest_s
        for message_id, due_s in self._due_s.items():
            if now_s < due_s:
                continue
            interval_s = max(self._interval_s[message_id], fastest_s)
            self._due_s[message_id] = max(due_s + interval_s, now_s + interval_s * 0.5)
            message = self._telemetry.builders[message_id]()
            if message is not None:
                self._radio.broadcast(message)
        self._next_s = min(self._due_s.values(), default=math.inf)

    @property
    def _fastest_s(self) -> float:
        """No stream is sent more often, in vehicle time."""
        return self._clock.speed / FASTEST_WALL_HZ if self._clock.speed > 1.0 else 0.0

    def _change_speed(self, factor: float) -> None:
        """What was thinned at a high speed must not leave a silence at a low one."""
        now_s, fastest_s = self._clock.now_s, self._fastest_s
        for message_id, due_s in self._due_s.items():
            self._due_s[message_id] = min(due_s, now_s + max(self._interval_s[message_id], fastest_s))
        self._next_s = now_s

    def set_interval(self, message_id: int, interval_us: float) -> bool:
        """SET_MESSAGE_INTERVAL: 0 is the default rate, -1 stops. False when there is no such stream."""
        if message_id not in self._telemetry.builders:
            return False
        if interval_us < 0.0:
            self._interval_s.pop(message_id, None)
            self._due_s.pop(message_id, None)
            return True
        default_s = 1.0 / self._default_hz.get(message_id, 1.0)
        self._interval_s[message_id] = interval_us / 1e6 if interval_us > 0.0 else default_s
        self._due_s[message_id] = self._next_s = self._clock.now_s
        return True

    def interval_us(self, message_id: int) -> int:
        """GET_MESSAGE_INTERVAL: 0 for a message that is not sent regularly."""
        return round(self._interval_s.get(message_id, 0.0) * 1e6)
