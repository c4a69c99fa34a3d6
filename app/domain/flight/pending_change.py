"""A changed mission that was sent to a vehicle in flight, until it is known whether it arrived."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.prediction import Timeline
from app.domain.progress import Progress
from app.domain.run import PlanChange
from app.domain.vehicle import VehicleState

SETTLED_S: Final = 3.0
"""MISSION_CURRENT comes at 1 Hz, and some may be lost."""


@dataclass(frozen=True, slots=True)
class PendingChange:
    """`mission` is the rest of `plan`.

    `is_open` while it is under way, and until it is known which of the two the vehicle flies: no release is sent then.
    """

    change: PlanChange
    plan: Plan
    mission: Mission
    timeline: Timeline
    follows: bool
    """It goes on with whatever item is flown, and not with one that was named."""

    is_same: bool = False
    """The vehicle carries this very mission already: that it names it says nothing of the transfer."""

    is_open: bool = True
    ended_s: float | None = None
    """When its transfer ended without a word whether it arrived; monotonic."""

    def is_missing(self, state: VehicleState, since_s: float, now_s: float) -> bool:
        """Whether the vehicle has gone on naming another mission, heard since then and after the transfer.

        The very same mission is missing too, unless its transfer said that it arrived: it is flown on as before.
        """
        if self.ended_s is None or not state.mission_id:
            return False
        return self.is_open and now_s - max(self.ended_s, since_s) > SETTLED_S

    def has_arrived(self, state: VehicleState) -> bool:
        """Whether the vehicle names it as the mission that it carries (MISSION_CURRENT.mission_id)."""
        return state.mission_id == self.change.mission_id and not self.is_same

    def first_seq(self, flown_by: Plan, progress: Progress) -> int:
        """Its item to go on with, if the vehicle has come further in `flown_by` while it was under way.

        0 if anything before that is news: what a change brings is never skipped, and flying back does no harm.
        """
        current = progress.item_id
        seqs = self.mission.seqs_of(current) if self.follows and current is not None else ()
        first = seqs[0] if seqs else 0
        before = {self.mission.plan_item_of[seq] for seq in range(first) if seq in self.mission.plan_item_of}
        flown = {item.id: item for item in flown_by.items if item.id in progress.flown}
        as_flown = all(item == flown.get(item.id) for item in self.plan.items if item.id in before)
        return first if as_flown else 0
