"""Says it when the machine cannot keep the speed that was asked for, and when it can again."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from app.simulator.pace import Pace, SpeedReport

LOOK_S = 1.0


class PaceWatch:
    """A slower clock changes no flight, but whoever waits by the wall clock must know of it."""

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
