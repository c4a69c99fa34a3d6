"""Notes when each item of a flight began and ended, on the vehicle's clock, as events of the run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from app.domain.drop import DropPhase
from app.domain.events.run import RunItemEnded
from app.domain.flight.leg import Release
from app.domain.flight.look import Look
from app.domain.item_times import EndedItem, ItemTimes
from app.domain.mission import Mission
from app.domain.progress import Progress
from app.domain.vehicle import LandedState, VehicleState

LONGEST_BLINK_S: Final = 2.0
"""Of ours: what ended while nothing was heard for longer has no time."""


@dataclass(frozen=True, slots=True)
class ItemClock:
    """Told of each look at the vehicle. `heard_s` is our time of the last one, `now_s` the vehicle's."""

    plan_item_of: Mapping[int, str]
    times: ItemTimes
    is_running: bool = False
    heard_s: float | None = None
    now_s: float | None = None

    @classmethod
    def of(cls, mission: Mission) -> ItemClock:
        """Before the flight."""
        return cls(mission.plan_item_of, ItemTimes.of(mission))

    def taken_up(self, flown: Sequence[str]) -> ItemClock:
        """Somebody else saw the first items, and nobody the beginning of the present one."""
        return replace(self, times=self.times.taken_up(len(flown)), is_running=True)

    def flown_on(self, mission: Mission) -> ItemClock:
        """The plan was changed in flight: its first item begins now, also if the vehicle was on its way to it."""
        return replace(self, plan_item_of=mission.plan_item_of, times=self.times.flown_on(mission, self.now_s))

    def look(
        self, seen: Look, progress: Progress, releases: Iterable[Release], *, was_airborne: bool, is_paused: bool
    ) -> tuple[ItemClock, tuple[RunItemEnded, ...]]:
        """After each look at a vehicle that is heard. `is_paused`: as it was at the look before, and still is."""
        now_s, times = _vehicle_s(seen), self.times
        if self.now_s is not None and now_s is not None and is_paused:
            times = times.paused(now_s - self.now_s)
        gap = self.heard_s is not None and seen.now_s - self.heard_s > LONGEST_BLINK_S
        if not self.is_running:
            times = times.started(now_s)
        landed = was_airborne and _has_landed(seen.state)
        times, ended = times.seen(progress, now_s, landed=landed, gap=gap)
        for release in releases:
            anchor_id = self.plan_item_of.get(release.compiled.hold_seqs[-1])
            if _was_ordered_now(release, progress) and anchor_id not in (None, release.compiled.plan_item_id):
                times, more = times.releases(str(anchor_id), now_s)
                ended += more
        after = replace(self, times=times, is_running=True, heard_s=seen.now_s, now_s=now_s)
        return after, tuple([_told(item) for item in ended])


def _told(item: EndedItem) -> RunItemEnded:
    return RunItemEnded(item_id=item.item_id, began_s=item.began_s, ended_s=item.ended_s, paused_s=item.paused_s)


def _was_ordered_now(release: Release, progress: Progress) -> bool:
    """The vehicle waits at this drop, and its release was ordered, or an operator is asked for it."""
    waits = progress.current in release.compiled.hold_seqs
    return release.compiled.supervised and waits and release.record.phase in (DropPhase.ASKING, DropPhase.RELEASING)


def _has_landed(state: VehicleState) -> bool:
    return state.landed is LandedState.ON_GROUND or state.armed is False


def _vehicle_s(seen: Look) -> float | None:
    """The vehicle's clock now: the newest position's, and what has passed since."""
    state = seen.state
    if state.boot_time_s is None or state.position_age_s is None:
        return None
    return state.boot_time_s + state.position_age_s * seen.clock_rate
