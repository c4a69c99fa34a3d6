"""Notes when each item of a flight began and ended, on the vehicle's clock, as events of the run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from app.domain.drop import DropPhase
from app.domain.events.run import RunItemEnded
from app.domain.item_times import EndedItem, ItemTimes
from app.domain.mission import Mission
from app.domain.progress import Progress
from app.domain.run import RunState
from app.domain.vehicle import FlightMode, LandedState, VehicleState
from app.services.runs.evidence import Look
from app.services.runs.orders import Release
from app.services.runs.recorder import RunRecorder

LONGEST_BLINK_S: Final = 2.0
"""Of ours: what ended while nothing was heard for longer has no time."""


class ItemClock:
    """Told of each look at the vehicle; `recorder` keeps what it notes."""

    def __init__(self, mission: Mission, recorder: RunRecorder) -> None:
        self._plan_item_of = mission.plan_item_of
        self._recorder = recorder
        self._times = ItemTimes.of(mission)
        self._is_running = False
        self._heard_s: float | None = None
        self._now_s: float | None = None

    def take_up(self, flown: Sequence[str]) -> None:
        """Somebody else saw the first items, and nobody the beginning of the present one."""
        self._times, self._is_running = self._times.taken_up(len(flown)), True

    def fly_on(self, mission: Mission) -> None:
        """The plan was changed in flight: its first item begins now, also if the vehicle was on its way to it."""
        self._plan_item_of = mission.plan_item_of
        self._times = self._times.flown_on(mission, self._now_s)

    def look(self, seen: Look, progress: Progress, releases: Iterable[Release], *, was_airborne: bool) -> None:
        """After each look at a vehicle that is heard."""
        before_s, now_s = self._now_s, _vehicle_s(seen)
        self._now_s = now_s
        if before_s is not None and now_s is not None and self._is_paused(seen.state):
            self._times = self._times.paused(now_s - before_s)
        gap = self._heard_s is not None and seen.now_s - self._heard_s > LONGEST_BLINK_S
        self._heard_s = seen.now_s
        if not self._is_running:
            self._is_running, self._times = True, self._times.started(now_s)
        landed = was_airborne and _has_landed(seen.state)
        self._times, ended = self._times.seen(progress, now_s, landed=landed, gap=gap)
        self._note(ended)
        for release in releases:
            anchor_id = self._plan_item_of.get(release.compiled.hold_seqs[-1])
            if _was_ordered_now(release, progress) and anchor_id not in (None, release.compiled.plan_item_id):
                self._times, ended = self._times.releases(str(anchor_id), now_s)
                self._note(ended)

    def _is_paused(self, state: VehicleState) -> bool:
        """As it was at the look before, and still is."""
        return self._recorder.run.state is RunState.PAUSED and state.mode is not FlightMode.MISSION

    def _note(self, ended: Iterable[EndedItem]) -> None:
        for item in ended:
            self._recorder.note(
                RunItemEnded(item_id=item.item_id, began_s=item.began_s, ended_s=item.ended_s, paused_s=item.paused_s)
            )


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
