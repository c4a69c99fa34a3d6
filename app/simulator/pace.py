"""Vehicle time against wall time: which steps are due, and how fast time really runs."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from app.simulator.clock import VehicleClock

MAX_BEHIND_S = 0.25
"""When the machine cannot keep up, vehicle time runs slower instead of catching up in one jump."""
WINDOW_S = 5.0
"""The achieved speed is that of the last so many seconds."""
SAMPLE_S = 0.25
SHORTEST_S = 1.0
BEHIND, CAUGHT_UP = 0.95, 0.98
"""Shares of the wanted speed: below the first it is behind, and above the second no longer."""


@dataclass(frozen=True, slots=True)
class SpeedReport:
    """`achieved` is vehicle time over wall time lately, None in the first second; `lost_s` wall time given up so far.

    `latest_s` is how late the latest step of the last seconds came.
    """

    wanted: float
    achieved: float | None
    behind: bool
    lost_s: float
    latest_s: float


@dataclass(frozen=True, slots=True)
class _Sample:
    wall_s: float
    steps: int
    latest_s: float


class Pace:
    """One clock for all vehicles of a process. `speed` is vehicle time over wall time, `wall` gives seconds."""

    def __init__(self, speed: float, wall: Callable[[], float]) -> None:
        self.speed = speed
        """Vehicle time over wall time, as wanted."""
        self._step_s = VehicleClock.STEP_S / speed
        self._wall = wall
        self._due_s = wall()
        self._steps = 0
        self._lost_s = 0.0
        self._latest_s = 0.0
        self._behind = False
        self._samples = deque([_Sample(self._due_s, 0, 0.0)])

    def begin(self) -> None:
        """Time runs from now on."""
        self._due_s = self._wall()
        self._samples = deque([_Sample(self._due_s, self._steps, 0.0)])

    def change(self, speed: float) -> None:
        """Time goes on where it is, at another speed. Steps that were late are not caught up at the new one."""
        self.speed, self._step_s = speed, VehicleClock.STEP_S / speed
        self._lost_s += max(0.0, self._wall() - self._due_s)
        self._behind = False
        self.begin()

    def take(self) -> bool:
        """Whether a step of the vehicles is due; counts it."""
        now_s = self._wall()
        late_s = now_s - self._due_s
        if late_s < 0.0:
            return False
        self._latest_s = max(self._latest_s, late_s)
        if late_s > MAX_BEHIND_S:
            self._lost_s += late_s - MAX_BEHIND_S
            self._due_s = now_s - MAX_BEHIND_S
        self._due_s += self._step_s
        self._steps += 1
        if now_s - self._samples[-1].wall_s >= SAMPLE_S:
            self._remember(now_s)
        return True

    def wait_s(self) -> float:
        """Wall time until the next step; 0 when it is due."""
        return max(0.0, self._due_s - self._wall())

    def report(self) -> SpeedReport:
        first, last = self._samples[0], self._samples[-1]
        achieved = None
        if last.wall_s - first.wall_s >= SHORTEST_S:
            achieved = (last.steps - first.steps) * VehicleClock.STEP_S / (last.wall_s - first.wall_s)
        latest_s = max(self._latest_s, *(sample.latest_s for sample in self._samples))
        return SpeedReport(self.speed, achieved, self._behind, self._lost_s, latest_s)

    def _remember(self, now_s: float) -> None:
        self._samples.append(_Sample(now_s, self._steps, self._latest_s))
        self._latest_s = 0.0
        while now_s - self._samples[1].wall_s >= WINDOW_S:
            self._samples.popleft()
        achieved = self.report().achieved
        if achieved is not None:
            self._behind = achieved < self.speed * (CAUGHT_UP if self._behind else BEHIND)


LOOK_S = 1.0


class PaceWatch:
    """Says when the machine is too slow for the speed: no flight changes, but who waits by the wall clock must know."""

    def __init__(self, pace: Pace, say: Callable[[str], None]) -> None:
        self._pace = pace
        self._say = say
        self._was_behind = False

    async def run(self) -> None:
        """Look once a second, until cancelled."""
        while True:
            await asyncio.sleep(LOOK_S)
            self.look()

    def look(self) -> None:
        """Say what has changed."""
        report = self._pace.report()
        if report.behind == self._was_behind or report.achieved is None:
            return
        self._was_behind = report.behind
        self._say(_slow(report) if report.behind else f"the vehicles' time runs {report.wanted:g}x again")


def _slow(report: SpeedReport) -> str:
    return (
        f"warning: this machine cannot keep {report.wanted:g}x: the vehicles' time runs {report.achieved:.1f}x. "
        "They fly the same, only slower; use a lower --speed or fewer vehicles"
    )
