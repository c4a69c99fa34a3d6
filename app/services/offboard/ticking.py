"""The ticks of one vehicle's control, from its lease to the end of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import structlog

from app.services.clock import Clock
from app.services.offboard.pacer import Pacer

log = structlog.get_logger(__name__)


class Ticking:
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
        self._pacer: Pacer | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self, rate_hz: float) -> None:
        """Tick from now on."""
        monotonic = self._clock.monotonic
        self._pacer = Pacer(1.0 / rate_hz, self._gap_s, self._on_tick, self._on_gap, monotonic=monotonic)
        self._task = asyncio.create_task(self._pacer.run(), name=f"offboard {self._vehicle_id}")
        self._task.add_done_callback(self._ended)

    def stop(self) -> None:
        """No more ticks. Idempotent."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    def look(self) -> None:
        """Tell `on_gap` if the last tick is too long ago: asked by all that may run before the next one."""
        if self._pacer is not None:
            self._pacer.stood_still()

    def _ended(self, task: asyncio.Task[None]) -> None:
        if task.cancelled() or (error := task.exception()) is None:
            return
        log.error("a defect ended the ticks of offboard control", vehicle=self._vehicle_id, exc_info=error)
        if task is self._task:
            self._on_defect()
