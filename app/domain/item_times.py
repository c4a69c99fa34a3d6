"""When each item of a flight began and ended, on the vehicle's own clock, from what a link shows of it.

PX4 reports some items as reached before they are done: a landing when it is over its point, a return as it begins, a
VTOL's takeoff and transition when it has turned. Those end when the next item is current, or with the landing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from app.domain.mission import MavCmd, Mission
from app.domain.progress import Progress

REPORTED_EARLY: Final = frozenset(
    {
        MavCmd.NAV_LAND,
        MavCmd.NAV_VTOL_LAND,
        MavCmd.NAV_RETURN_TO_LAUNCH,
        MavCmd.NAV_VTOL_TAKEOFF,
        MavCmd.DO_VTOL_TRANSITION,
    }
)


@dataclass(frozen=True, slots=True)
class EndedItem:
    """One visit of a plan item, in seconds of the vehicle's clock; None: not seen. `paused_s`: of them in a pause."""

    item_id: str
    began_s: float | None
    ended_s: float | None
    paused_s: float = 0.0


@dataclass(frozen=True, slots=True)
class ItemTimes:
    """`seqs` are the first and the last mission item of each plan item, `early` those that are reported early.

    `counted` is how many of the flown items have ended. `ahead`: the next one ended already, at a drop's release.
    `began_s`: when the item under way began, None if that was not seen. `paused_s`: how long the run was paused since.
    """

    seqs: Mapping[str, tuple[int, int]]
    early: frozenset[str]
    counted: int = 0
    began_s: float | None = None
    ahead: bool = False
    paused_s: float = 0.0

    @classmethod
    def of(cls, mission: Mission) -> ItemTimes:
        """Before the start."""
        seqs: dict[str, tuple[int, int]] = {}
        for seq, item_id in sorted(mission.plan_item_of.items()):
            seqs[item_id] = (seqs.get(item_id, (seq, seq))[0], seq)
        commands = {item.seq: item.command for item in mission.items}
        early = frozenset(item_id for item_id, (_, last) in seqs.items() if commands.get(last) in REPORTED_EARLY)
        return cls(seqs, early)

    def started(self, now_s: float | None) -> ItemTimes:
        """The first item begins."""
        return self._next(now_s)

    def paused(self, seconds: float) -> ItemTimes:
        """The run was paused for so long, in the item under way."""
        return replace(self, paused_s=self.paused_s + max(0.0, seconds))

    def taken_up(self, flown: int) -> ItemTimes:
        """Somebody else, or nobody, saw the first `flown` items."""
        return replace(self._next(None), counted=flown)

    def flown_on(self, mission: Mission, began_s: float | None) -> ItemTimes:
        """Another mission goes on behind the items that were counted; its first item began then."""
        return replace(ItemTimes.of(mission), counted=self.counted, began_s=began_s)

    def releases(self, anchor_id: str, now_s: float | None) -> tuple[ItemTimes, tuple[EndedItem, ...]]:
        """A supervised release is ordered: the item at which the vehicle waits for it is over, and the drop begins."""
        if self.ahead:
            return self, ()
        ended = EndedItem(anchor_id, self.began_s, now_s, self.paused_s)
        return replace(self._next(now_s), ahead=True), (ended,)

    def seen(
        self, progress: Progress, now_s: float | None, *, landed: bool, gap: bool
    ) -> tuple[ItemTimes, tuple[EndedItem, ...]]:
        """What ended since the last look. `gap`: the vehicle was not heard for a while, so nobody saw when."""
        times, ended = self, []
        while times.counted < len(progress.flown):
            item_id = progress.flown[times.counted]
            is_newest = times.counted == len(progress.flown) - 1
            if is_newest and times._is_under_way(item_id, progress) and not (landed and item_id in times.early):
                break
            at_s = None if gap else now_s
            if not times.ahead:
                ended.append(EndedItem(item_id, times.began_s, at_s, times.paused_s))
                times = times._next(at_s)
            times = replace(times, counted=times.counted + 1, ahead=False)
        if gap and times.counted > self.counted:
            times = replace(times, began_s=None)
        return times, tuple(ended)

    def _next(self, began_s: float | None) -> ItemTimes:
        return replace(self, began_s=began_s, paused_s=0.0)

    def _is_under_way(self, item_id: str, progress: Progress) -> bool:
        """Only the first of its mission items are passed, or it is reported as reached and still being done."""
        first, last = self.seqs.get(item_id, (0, -1))
        if first <= progress.passed_to < last:
            return True
        is_current = progress.current is None or progress.current <= last
        return item_id in self.early and progress.passed_to >= last and is_current
