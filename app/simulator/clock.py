"""A vehicle's own time. It runs `speed` times faster than the wall and restarts at a reboot."""

from __future__ import annotations

from collections.abc import Callable


class VehicleClock:
    """Seconds since boot, advanced by the fleet in fixed steps: the physics are the same at every speed."""

    STEP_S = 0.02

    def __init__(self, first_s: float = 0.0, speed: float = 1.0) -> None:
        self._start_s = first_s
        self._steps = 0
        self.now_s = first_s
        self.speed = speed
        """Vehicle time over wall time."""
        self._on_speed: list[Callable[[float], None]] = []

    def advance(self) -> None:
        """One step. Counted, not summed, so that a long run does not drift."""
        self._steps += 1
        self.now_s = self._start_s + self._steps * self.STEP_S

    def restart(self) -> None:
        """A reboot: time begins again."""
        self._steps = 0
        self.now_s = self._start_s

    def change_speed(self, speed: float) -> None:
        """Time goes on from where it is. Whoever waits for somebody on the ground is notified of the new rate."""
        factor, self.speed = speed / self.speed, speed
        for listener in self._on_speed:
            listener(factor)

    def on_speed(self, listener: Callable[[float], None]) -> None:
        """Call `listener` with the new speed over the old one, after each change."""
        self._on_speed.append(listener)

    def same_by_the_wall(self, at_s: float, factor: float) -> float:
        """A moment in the past, moved so that after a change of speed it is as long ago by the wall as it was."""
        return self.now_s - (self.now_s - at_s) * factor

    @property
    def boot_ms(self) -> int:
        """`time_boot_ms` of messages."""
        return int(self.now_s * 1000.0 + 0.5)
