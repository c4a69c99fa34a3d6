"""Compares what flew with what was predicted, from the events of the run."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Sequence
from typing import Final

from app.domain.comparison import Comparison, compare
from app.domain.events import Event
from app.domain.events.run import RunItemEnded, RunMissionChanged, RunPredicted
from app.domain.item_times import EndedItem
from app.domain.prediction import Timeline
from app.domain.reason import Reason, ReasonCode, because
from app.services.journal import Journal
from app.services.runs import Runs

PAGE_EVENTS: Final = 100
NOT_PREDICTED: Final = "no prediction was recorded"


class Comparisons:
    """A comparison is made anew from the journal each time it is asked for."""

    def __init__(self, runs: Runs, journal: Journal) -> None:
        self._runs = runs
        self._journal = journal

    async def of(self, run_id: str) -> Comparison:
        """The comparison of one run, of this moment. Raises NotFoundError, StorageError."""
        run = await self._runs.get(run_id)
        told, after = _Told(), 0
        while events := await self._journal.read(after, PAGE_EVENTS, run_id=run.id):
            await asyncio.to_thread(told.take, events)
            after = events[-1].seq
        return await asyncio.to_thread(compare, run, told.timeline, told.flown, told.why_none)


class _Told:
    """What the run's events say of it."""

    def __init__(self) -> None:
        self.timeline: Timeline | None = None
        self.flown: list[EndedItem] = []

    @property
    def why_none(self) -> Reason | None:
        return because(ReasonCode.RUN_NOT_PREDICTED) if self.timeline is None else None

    def take(self, events: Sequence[Event]) -> None:
        for event in events:
            match event.data:
                case RunPredicted(root=timeline):
                    self.timeline = timeline
                case RunMissionChanged(timeline=rest):
                    self._take_change(rest)
                case RunItemEnded() as ended:
                    self.flown.append(EndedItem(ended.item_id, ended.began_s, ended.ended_s, ended.paused_s))
                case _:
                    pass  # tells nothing of how long an item took

    def _take_change(self, rest: Timeline) -> None:
        """The plan was changed in flight: what was flown stays compared with what was predicted for it."""
        visits: Counter[str] = Counter()
        flown: set[tuple[str, int]] = set()
        for ended in self.flown:
            visits[ended.item_id] += 1
            flown.add((ended.item_id, visits[ended.item_id]))
        if self.timeline is not None:
            self.timeline = self.timeline.continued(flown, rest)
