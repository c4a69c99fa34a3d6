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
    """Keeps the newest report of each feed. Nothing is stored: what a flight made of it is in the journal."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._kept: dict[str, _Kept] = {}

    def report(self, feed: str, report: TargetReport) -> TargetFix:
        """Take a report. The same one again changes nothing.

        Raises:
            InvalidInputError: it is of the future, so the clocks differ.
            ConflictError: a newer one is known, or there are too many feeds.
        """
        age_s = self._clock.now() - report.time
        if age_s < -AHEAD_S:
            raise InvalidInputError(
                f"the report is {-age_s:.1f} s ahead of Waydrop's clock",
                hint="set the clocks of both machines by NTP; time is when the position was measured, in Unix seconds",
            )
        known = self._kept.get(feed)
        if known is not None and report.time < known.report.time:
            raise ConflictError(
                "a newer report of this target is known", hint="send reports in the order of their time"
            )
        if known is None or known.report != report:
            self._make_room(feed)
            self._kept[feed] = _Kept(report, max(age_s, 0.0), self._clock.monotonic())
        return self.fix(feed)

    def fix(self, feed: str) -> TargetFix:
        """What is known of a target now. Raises NotFoundError."""
        kept = self._kept.get(feed)
        if kept is None:
            raise NotFoundError(f"nothing was reported by {feed!r}", hint="POST its position to the same path")
        return TargetFix(feed, kept.report, kept.age_s + self._clock.monotonic() - kept.received_s)

    def all(self) -> tuple[TargetFix, ...]:
        """What is known of every target now, by feed."""
        return tuple(self.fix(feed) for feed in sorted(self._kept))

    def fixes(self, feeds: Iterable[str]) -> Mapping[str, TargetFix]:
        """What is known of these targets now; without those of which nothing is."""
        return {feed: self.fix(feed) for feed in feeds if feed in self._kept}

    def _make_room(self, feed: str) -> None:
        if feed in self._kept or len(self._kept) < MOST_FEEDS:
            return
        oldest = max(self._kept, key=lambda known: self.fix(known).age_s)
        if not self.fix(oldest).is_stale:
            raise ConflictError(f"{MOST_FEEDS} feeds report already", hint="wait until one has ended")
        del self._kept[oldest]
