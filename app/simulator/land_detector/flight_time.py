"""The total flight time, kept in two parameters."""

from __future__ import annotations

from app.simulator.params import Params

HIGH, LOW = "LND_FLIGHT_T_HI", "LND_FLIGHT_T_LO"
"""Together 64 bits of microseconds."""
WORD = 1 << 32
SIGN = 1 << 31


class FlightTime:
    """Counts from the first take-off after arming until disarming; stored then, so a reboot in the air loses it."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._took_off_s: float | None = None

    def restart(self) -> None:
        """Power-up."""
        self._took_off_s = None

    def take_off(self, now_s: float) -> None:
        """The vehicle left the ground; counts once until disarming."""
        if self._took_off_s is None:
            self._took_off_s = now_s

    def disarm(self, now_s: float) -> None:
        """The vehicle was disarmed."""
        if self._took_off_s is None:
            return
        total_us = self.total_us + round((now_s - self._took_off_s) * 1e6)
        self._took_off_s = None
        self._params.set(HIGH, total_us // WORD)
        low = total_us % WORD
        self._params.set(LOW, low - WORD if low >= SIGN else low)  # PX4 stores the bits in an int32

    @property
    def total_us(self) -> int:
        """As stored."""
        return self._params.integer(HIGH) * WORD + self._params.integer(LOW) % WORD
