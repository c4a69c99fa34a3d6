"""The feeds of moving targets: their newest reports, in memory. After a restart of ours nothing is known of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from app.domain.errors import ConflictError, InvalidInputError, NotFoundError
from app.domain.targets import TargetFix, TargetReport
from app.services.clock import Clock

MOST_FEEDS: Final = 256
AHEAD_S: Final = 1.0
"""A report may be so far ahead of our clock: theirs and ours differ a little."""


@dataclass(frozen=True, slots=True)
class _Kept:
    report: TargetReport
    age_s: float
    """When it was received, at `received_s` of our monotonic clock: its age then does not depend on our wall clock."""
    received_s: float


class Targets:
    """Keeps the newest report of each feed. Nothing is stored: the moves of a flight are in the journal."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._kept: dict[str, _Kept] = {}

    async def accept(self, feed: str, report: TargetReport) -> TargetFix:
        """Add a report of a client for all who follow the target. Raises as `report`."""
        return self.report(feed, report)

    def report(self, feed: str, report: TargetReport) -> TargetFix:
        """Add a report. Repeating it has no effect.

        Raises:
            InvalidInputError: its time is in the future, so the clocks differ.
            ConflictError: a newer one is known, or there are too many feeds. One that is stale is none: the clocks may
                have been set back since.
        """
        age_s = self.checked_age_s(feed, report)
        known = self._kept.get(feed)
        if known is None or known.report != report:
            self._kept.pop(self._in_the_way(feed), None)
            self._kept[feed] = _Kept(report, max(age_s, 0.0), self._clock.monotonic())
        return self.fix(feed)

    def checked_age_s(self, feed: str, report: TargetReport) -> float:
        """The age of a report that may be added, below zero if its clock is ahead. Raises as `report`."""
        age_s = self._clock.now() - report.time
        if age_s < -AHEAD_S:
            raise InvalidInputError(
                f"the report is {-age_s:.1f} s ahead of Waydrop's clock",
                hint="synchronize both clocks by NTP; time is the time of the measurement in Unix seconds",
            )
        known = self._kept.get(feed)
        if known is not None and report.time < known.report.time and not self.fix(feed).is_stale:
            raise ConflictError(
                "a newer report of this target was already received", hint="send reports in chronological order"
            )
        self._in_the_way(feed)
        return age_s

    def fix(self, feed: str) -> TargetFix:
        """Return the current estimate of a target. Raises NotFoundError."""
        kept = self._kept.get(feed)
        if kept is None:
            raise NotFoundError(f"no report from {feed!r} was received", hint="POST its position to the same path")
        return TargetFix(feed, kept.report, kept.age_s + self._clock.monotonic() - kept.received_s)

    def all(self) -> tuple[TargetFix, ...]:
        """The current estimate of every target, by feed."""
        return tuple(self.fix(feed) for feed in sorted(self._kept))

    def fixes(self, feeds: Iterable[str]) -> Mapping[str, TargetFix]:
        """The current estimates of these targets, without unknown ones."""
        return {feed: self.fix(feed) for feed in feeds if feed in self._kept}

    def _in_the_way(self, feed: str) -> str:
        """The stale feed whose place this one takes; empty if there is room. Raises ConflictError."""
        if feed in self._kept or len(self._kept) < MOST_FEEDS:
            return ""
        oldest = max(self._kept, key=lambda known: self.fix(known).age_s)
        if not self.fix(oldest).is_stale:
            raise ConflictError(
                f"{MOST_FEEDS} feeds are already reporting, which is the limit", hint="wait until one has ended"
            )
        return oldest
