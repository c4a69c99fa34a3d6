"""Ticks at a steady rate on the monotonic clock, and notices when the process or the machine stood still."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable


def uptime_s() -> float:
    """Seconds that go on while the machine is suspended, where the system has such a clock."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


class Pacer:
    """Calls `on_tick(monotonic seconds)`. Ticks that were missed are left out, never made up for in a burst."""

    def __init__(
        self,
        period_s: float,
        gap_s: float,
        on_tick: Callable[[float], None],
        on_gap: Callable[[float], None],
        *,
        monotonic: Callable[[], float] = time.monotonic,
        uptime: Callable[[], float] = uptime_s,
    ) -> None:
        self._period_s = period_s
        self._gap_s = gap_s
        self._on_tick = on_tick
        self._on_gap = on_gap
        self._monotonic = monotonic
        self._uptime = uptime
        self._seen_s = uptime()

    def stood_still(self) -> bool:
        """Whether the last tick is too long ago; tells `on_gap` then. Asked by all that may run before the tick."""
        gap_s = self._uptime() - self._seen_s
        if gap_s <= self._gap_s:
            return False
        self._seen_s = self._uptime()
        self._on_gap(gap_s)
        return True

    async def run(self) -> None:
        """Tick until cancelled. After a gap nothing is ticked any more."""
        due_s = self._monotonic()
        self._seen_s = self._uptime()
        while True:
            if self.stood_still():
                return
            self._seen_s = self._uptime()
            self._on_tick(self._monotonic())
            due_s = next_due_s(due_s, self._monotonic(), self._period_s)
            await asyncio.sleep(max(0.0, due_s - self._monotonic()))


def next_due_s(due_s: float, now_s: float, period_s: float) -> float:
    """The first moment of the grid after both `due_s` and `now_s`."""
    missed = max(0, math.floor((now_s - due_s) / period_s))
    return due_s + (missed + 1) * period_s
