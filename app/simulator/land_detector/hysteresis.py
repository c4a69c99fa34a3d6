"""PX4's systemlib::Hysteresis: a state that follows its input only when the input has stayed for a time."""

from __future__ import annotations

TOLERANCE_S = 1e-9
"""Vehicle time is a multiple of 20 ms in binary fractions."""


class Hysteresis:
    """`rise_s` is the wait from False to True, `fall_s` from True to False."""

    def __init__(self, state: bool = False) -> None:
        self.state = state
        self.rise_s = 0.0
        self.fall_s = 0.0
        self._requested = state
        self._since_s = 0.0

    def update(self, wanted: bool, now_s: float) -> bool:
        """Give the input at this time; returns the state."""
        if wanted != self._requested:
            self._requested = wanted
            self._since_s = now_s
        if self._requested != self.state:
            wait_s = self.rise_s if self._requested else self.fall_s
            if now_s - self._since_s >= wait_s - TOLERANCE_S:
                self.state = self._requested
        return self.state
