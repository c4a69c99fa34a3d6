"""Measures the delays of the event loop, and reports what caused a stall."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import threading
import time
from bisect import bisect_left
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from types import FrameType
from typing import Final

import structlog

from app.domain.errors import StorageError
from app.domain.events.service import LoopStalled
from app.domain.ports.journal import EventJournal
from app.services.background import background

log = structlog.get_logger(__name__)

BOUNDS_S: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)
STALL_S: Final = 0.1
TICK_S: Final = 0.02
RECORD_EVERY_S: Final = 10.0
MOST_FRAMES: Final = 40


@dataclass(slots=True)
class LoopDelays:
    """How late the loop was at each tick, as a histogram: `counts` has one more place than BOUNDS_S."""

    counts: list[int] = field(default_factory=lambda: [0] * (len(BOUNDS_S) + 1))
    sum_s: float = 0.0
    worst_s: float = 0.0

    def add(self, delay_s: float) -> None:
        self.counts[bisect_left(BOUNDS_S, delay_s)] += 1
        self.sum_s += delay_s
        self.worst_s = max(self.worst_s, delay_s)


@dataclass(frozen=True, slots=True)
class LoopWatchSettings:
    """A delay above `stall_s` is recorded, at most once in `record_every_s`: the longest of that time.

    A task of the loop ticks every `tick_s`; a thread checks as often whether it does.
    """

    stall_s: float = STALL_S
    tick_s: float = TICK_S
    record_every_s: float = RECORD_EVERY_S


class LoopWatch:
    """`delays` are there from the beginning; `watching` fills them. A stalled loop is recorded and logged."""

    def __init__(self, journal: EventJournal, settings: LoopWatchSettings | None = None) -> None:
        self.delays = LoopDelays()
        self._journal = journal
        self._settings = settings or LoopWatchSettings()
        self._due_s = 0.0
        self._stack: tuple[str, ...] = ()
        self._unrecorded: LoopStalled | None = None
        self._stalled = asyncio.Event()

    @contextlib.asynccontextmanager
    async def watching(self) -> AsyncIterator[None]:
        """Watch the loop that runs this, until the block ends."""
        ended = threading.Event()
        self._due_s = time.monotonic() + self._settings.tick_s
        sampling = threading.Thread(
            target=self._sample, args=(threading.get_ident(), ended), name="loop watch", daemon=True
        )
        sampling.start()
        try:
            async with background(self._tick(), "loop watch"), background(self._record(), "loop watch events"):
                yield
        finally:
            ended.set()
            sampling.join()

    async def _tick(self) -> None:
        while True:
            self._due_s = time.monotonic() + self._settings.tick_s
            cpu_s = time.thread_time()
            await asyncio.sleep(self._settings.tick_s)
            delay_s = max(0.0, time.monotonic() - self._due_s)
            self.delays.add(delay_s)
            if delay_s > self._settings.stall_s:
                self._note(delay_s, time.thread_time() - cpu_s)

    def _note(self, delay_s: float, cpu_s: float) -> None:
        stack, self._stack = self._stack, ()
        before = self._unrecorded
        found = LoopStalled(delay_s=round(delay_s, 4), cpu_s=round(cpu_s, 4), stack=stack)
        if before is not None:
            worst = before if before.delay_s >= found.delay_s else found
            found = worst.model_copy(update={"others": before.others + 1})
        self._unrecorded = found
        self._stalled.set()

    async def _record(self) -> None:
        while True:
            await self._stalled.wait()
            self._stalled.clear()
            stall, self._unrecorded = self._unrecorded, None
            if stall is None:
                continue
            at = stall.stack[-1] if stall.stack else "not seen"
            log.warning("the event loop stalled", delay_s=stall.delay_s, cpu_s=stall.cpu_s, others=stall.others, at=at)
            with contextlib.suppress(StorageError):  # logged
                await self._journal.record(self._journal.new_event(stall))
            await asyncio.sleep(self._settings.record_every_s)

    def _sample(self, loop_thread: int, ended: threading.Event) -> None:
        """Runs in a thread: only from outside is it visible where a stalled loop is."""
        sampled_s = 0.0
        while not ended.wait(self._settings.tick_s):
            due_s = self._due_s
            if due_s != sampled_s and time.monotonic() - due_s > self._settings.stall_s:
                sampled_s = due_s
                self._stack = _stack_of(sys._current_frames().get(loop_thread))


def _stack_of(frame: FrameType | None) -> tuple[str, ...]:
    """`module:line function`, the innermost last. No values and no paths: an event is for everybody who may read."""
    found: list[str] = []
    while frame is not None and len(found) < MOST_FRAMES:
        found.append(f"{frame.f_globals.get('__name__', '?')}:{frame.f_lineno} {frame.f_code.co_name}")
        frame = frame.f_back
    return tuple(reversed(found))
