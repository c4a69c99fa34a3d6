"""Ticks at a steady rate on the monotonic clock, which notice when the process or the machine stood still."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable

import structlog

from app.services.clock import Clock

log = structlog.get_logger(__name__)


def uptime_s() -> float:
    """Seconds that go on while the machine is suspended, where the system has such a clock."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


class RateClock:
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

    def check_gap(self) -> bool:
        """Whether the last tick is too long ago; calls `on_gap` then. For all that may run before the tick."""
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
            if self.check_gap():
                return
            self._seen_s = self._uptime()
            self._on_tick(self._monotonic())
            due_s = next_due_s(due_s, self._monotonic(), self._period_s)
            await asyncio.sleep(max(0.0, due_s - self._monotonic()))


def next_due_s(due_s: float, now_s: float, period_s: float) -> float:
    """The first moment of the grid after both `due_s` and `now_s`."""
    missed = max(0, math.floor((now_s - due_s) / period_s))
    return due_s + (missed + 1) * period_s


class RateLoop:
    """`on_defect` is called when a tick failed in a way that nobody foresaw: there are no more ticks then."""

    def __init__(
        self,
        vehicle_id: str,
        clock: Clock,
        gap_s: float,
        on_tick: Callable[[float], None],
        on_gap: Callable[[float], None],
        on_defect: Callable[[], None],
    ) -> None:
        self._vehicle_id = vehicle_id
        self._clock = clock
        self._gap_s = gap_s
        self._on_tick = on_tick
        self._on_gap = on_gap
        self._on_defect = on_defect
        self._rate_clock: RateClock | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self, rate_hz: float) -> None:
        """Tick from now on."""
        monotonic = self._clock.monotonic
        self._rate_clock = RateClock(1.0 / rate_hz, self._gap_s, self._on_tick, self._on_gap, monotonic=monotonic)
        self._task = asyncio.create_task(self._rate_clock.run(), name=f"offboard {self._vehicle_id}")
        self._task.add_done_callback(self._ended)

    def stop(self) -> None:
        """No more ticks. Idempotent."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    def check_gap(self) -> None:
        """Call `on_gap` if the last tick is too long ago: for all that may run before the next one."""
        if self._rate_clock is not None:
            self._rate_clock.check_gap()

    def _ended(self, task: asyncio.Task[None]) -> None:
        if task.cancelled() or (error := task.exception()) is None:
            return
        log.error("offboard control stopped after an internal error", vehicle=self._vehicle_id, exc_info=error)
        if task is self._task:
            self._on_defect()
