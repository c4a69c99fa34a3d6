"""A vehicle's own time. It runs `speed` times faster than the wall and restarts at a reboot."""

from __future__ import annotations


class VehicleClock:
    """Seconds since boot, advanced by the fleet in fixed steps: the physics are the same at every speed."""

    STEP_S = 0.02

    def __init__(self, first_s: float = 0.0) -> None:
        self._start_s = first_s
        self._steps = 0
        self.now_s = first_s

    def advance(self) -> None:
        """One step. Counted, not summed, so that a long run does not drift."""
        self._steps += 1
        self.now_s = self._start_s + self._steps * self.STEP_S

    def restart(self) -> None:
        """A reboot: time begins again."""
        self._steps = 0
        self.now_s = self._start_s

    @property
    def boot_ms(self) -> int:
        """`time_boot_ms` of messages."""
        return int(self.now_s * 1000.0 + 0.5)
