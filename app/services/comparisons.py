"""Compares what flew with what was predicted, from the events of the run."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Sequence
from typing import Final

from pydantic import ValidationError

from app.domain.comparison import Comparison, compare
from app.domain.events import Event, EventKind
from app.domain.item_times import EndedItem
from app.domain.prediction import Timeline
from app.services.journal import Journal
from app.services.runs import Runs

PAGE_EVENTS: Final = 100
NOT_PREDICTED: Final = "the run was made by a version of Waydrop that recorded no prediction"
NOT_READABLE: Final = "the prediction was recorded by another version of Waydrop, and cannot be read by this one"


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
        self.why_none = NOT_PREDICTED

    def take(self, events: Sequence[Event]) -> None:
        for event in events:
            if event.kind is EventKind.RUN_PREDICTED:
                self._take_prediction(event)
            elif event.kind is EventKind.RUN_MISSION_CHANGED:
                self._take_change(event)
            elif event.kind is EventKind.RUN_ITEM_ENDED:
                data = event.data
                times = data.get("began_s"), data.get("ended_s"), data.get("paused_s", 0.0)
                self.flown.append(EndedItem(str(data["item_id"]), *times))

    def _take_prediction(self, event: Event) -> None:
        try:
            self.timeline, self.why_none = Timeline.model_validate(event.data), ""
        except ValidationError:
            self.why_none = NOT_READABLE

    def _take_change(self, event: Event) -> None:
        """The plan was changed in flight: what was flown stays compared with what was predicted for it."""
        visits: Counter[str] = Counter()
        flown: set[tuple[str, int]] = set()
        for ended in self.flown:
            visits[ended.item_id] += 1
            flown.add((ended.item_id, visits[ended.item_id]))
        try:
            rest = Timeline.model_validate(event.data.get("timeline"))
        except ValidationError:
            self.timeline, self.why_none = None, NOT_READABLE
            return
        if self.timeline is not None:
            self.timeline = self.timeline.continued(flown, rest)
