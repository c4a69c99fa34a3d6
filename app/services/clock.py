"""Time as an input: services take a Clock, so that tests decide what time it is."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Two clocks: one to tell the time of day, one to measure durations."""

    def now(self) -> float:
        """Unix seconds. It may jump: only for what people read."""

    def monotonic(self) -> float:
        """Seconds from some start; never goes back: for deadlines and ages."""


class SystemClock:
    """The machine's clocks."""

    def now(self) -> float:
        return time.time()

    def monotonic(self) -> float:
        return time.monotonic()
