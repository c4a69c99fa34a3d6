"""The state of a flight. step.py changes it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from app.domain.drop.record import DropPhase, DropRecord
from app.domain.events import AnyPayload
from app.domain.events.run import RunChanged, RunDrop, RunItem, RunItemEnded, consent_told
from app.domain.flight.inputs import SETTLED_S, FlightEffect, PendingChange, Record, Sight
from app.domain.flight.leg import MissionSegment, Release
from app.domain.flight.look import Order, VehicleSnapshot
from app.domain.flight.modes import ModeTracker
from app.domain.flight.phase import is_offboard_reason
from app.domain.flight.progress import EndedItem, ItemTimes, MissionCompleteDetector, MissionProgress
from app.domain.mission import Mission
from app.domain.reasons import Reason
from app.domain.run.run import Asked, Run, RunState
from app.domain.vehicle.clock import UNHEARD, VehicleClock
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState

# Whether a run is paused because of offboard control, or because a user paused it.


@dataclass(frozen=True, slots=True)
class OffboardTracker:
    """Entering offboard control pauses the run. Leaving to Hold pauses it again, the dead-man timer does not.

    `had_it`: the vehicle was under offboard control since the last request. `mode` is the last observed mode.
    """

    had_it: bool = False
    mode: FlightMode | None = None

    def asked(self) -> OffboardTracker:
        """A user requests something now. From now on, its effects count as requested, before the vehicle has obeyed."""
        return OffboardTracker(False, self.mode)

    def seen(self, mode: FlightMode | None) -> OffboardTracker:
        """Update after an observation of a connected vehicle."""
        had_it = self.had_it
        if mode is FlightMode.OFFBOARD and self.mode is not FlightMode.OFFBOARD:
            had_it = True
        elif mode not in (FlightMode.OFFBOARD, FlightMode.HOLD, None):
            had_it = False
        return OffboardTracker(had_it, mode)


# Records start and end of each item of a flight, on the vehicle's clock, as events of the run.


LONGEST_BLINK_S: Final = 2.0
"""In service time. Items that ended during a longer gap in telemetry have no time."""


@dataclass(frozen=True, slots=True)
class ItemClock:
    """Updated with each observation. `heard_s` is the service time of the last one, `now_s` the vehicle time."""

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
        """The first items, and the start of the current one, were not observed by this process."""
        return replace(self, times=self.times.taken_up(len(flown)), is_running=True)

    def flown_on(self, mission: Mission) -> ItemClock:
        """The plan was changed in flight. Its first item starts now, even if the vehicle was already flying to it."""
        return replace(self, plan_item_of=mission.plan_item_of, times=self.times.flown_on(mission, self.now_s))

    def look(
        self,
        seen: VehicleSnapshot,
        progress: MissionProgress,
        releases: Iterable[Release],
        *,
        was_airborne: bool,
        is_paused: bool,
    ) -> tuple[ItemClock, tuple[RunItemEnded, ...]]:
        """Update after an observation of a connected vehicle. `is_paused`: since the observation before."""
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


def _was_ordered_now(release: Release, progress: MissionProgress) -> bool:
    """The vehicle waits at this drop, and its release was commanded or consent requested."""
    waits = progress.current in release.compiled.hold_seqs
    return release.compiled.supervised and waits and release.record.phase in (DropPhase.ASKING, DropPhase.RELEASING)


def _has_landed(state: VehicleState) -> bool:
    return state.landed is LandedState.ON_GROUND or state.armed is False


def _vehicle_s(seen: VehicleSnapshot) -> float | None:
    """The vehicle's time now: that of the newest position plus the time since."""
    state = seen.state
    if state.boot_time_s is None or state.position_age_s is None:
        return None
    return state.boot_time_s + state.position_age_s * seen.clock_rate


LOST_AFTER_S: Final = 900.0
DEFAULT_MAX_OFFSET_M: Final = 3.0


@dataclass(frozen=True, slots=True)
class Flight:
    """A run in flight.

    `leg` is the mission being flown, `progress` how far it is; `change` is a changed mission on its way to the vehicle,
    or possibly on board, and `skip_to` the item of it that the vehicle had already reached by then. `command` is the
    pending command, as in `run.asked`; `obeyed` is the last request that was observed to be done. `moving_on` counts
    unanswered commands that change the current item. `was_away`: it may have flown unobserved. `seen` is the last
    observation. `connected_at_s` is when it was last heard, `connected_since_s` since when without a gap. `effects` are
    those of the current step.
    """

    run: Run
    leg: MissionSegment
    progress: MissionProgress
    items: ItemClock
    connected_at_s: float
    lost_after_s: float = LOST_AFTER_S
    default_max_offset_m: float = DEFAULT_MAX_OFFSET_M
    offboard: OffboardTracker = field(default_factory=OffboardTracker)
    complete: MissionCompleteDetector = field(default_factory=MissionCompleteDetector)
    mode: ModeTracker = field(default_factory=ModeTracker)
    rate: VehicleClock = UNHEARD
    command: Asked | None = None
    obeyed: Asked | None = None
    moving_on: int = 0
    change: PendingChange | None = None
    skip_to: int = 0
    mission_done: bool = False
    was_airborne: bool = False
    was_armed: bool = False
    was_away: bool = False
    rebooted: bool = False
    first_look_s: float | None = None
    seen: VehicleState | None = None
    landed_at_s: float | None = None
    connected_since_s: float | None = None
    effects: tuple[FlightEffect, ...] = ()

    @classmethod
    def of(
        cls, run: Run, leg: MissionSegment, now_s: float, lost_after_s: float, default_max_offset_m: float
    ) -> Flight:
        """Return the flight before the first observation, at this monotonic time. A recovered run's reason may name
        offboard.
        """
        return cls(
            run,
            leg,
            MissionProgress.of(leg.mission),
            ItemClock.of(leg.mission),
            now_s,
            lost_after_s,
            default_max_offset_m,
            OffboardTracker(is_offboard_reason(run.reason)),
        )

    @property
    def is_changing(self) -> bool:
        """Whether it is unknown which of two missions the vehicle flies."""
        return self.change is not None and self.change.is_open

    @property
    def drop_is_busy(self) -> bool:
        """Whether the vehicle waits at a drop, was sent to an alternate, or the effect of a release is unknown."""
        open_ones = [release for release in self.leg.releases if not release.is_over]
        return self.moving_on > 0 or any(
            one.is_active or one.is_busy or one.record.alternate_to is not None for one in open_ones
        )

    def item_is_heard(self, now_s: float) -> bool:
        """Whether MISSION_CURRENT was received since the link was last restored."""
        return self.connected_since_s is not None and now_s - self.connected_since_s > SETTLED_S

    def look(self, sight: Sight) -> VehicleSnapshot:
        """Add the flight's knowledge of the vehicle's clock and of the request to an observation."""
        return VehicleSnapshot(
            sight.state,
            sight.now_s,
            sight.time_s,
            self.rate.rate,
            self.rate.is_measured,
            self.run.asked,
            is_changing=self.is_changing,
            targets=sight.targets,
        )

    def find(self, plan_item_id: str, leg: int) -> Release | None:
        """Return a drop of the leg with this number; None if the plan was changed since."""
        return self.leg.find(plan_item_id) if leg == self.run.changes else None

    def noted(self, payload: AnyPayload) -> Flight:
        """Add an event to store."""
        return replace(self, effects=(*self.effects, Record(payload)))

    def ordering(self, orders: tuple[Order, ...]) -> Flight:
        """Add commands to send."""
        return replace(self, effects=(*self.effects, *orders)) if orders else self

    def changed(self, sight: Sight, **fields: Any) -> Flight:
        """Update fields of the run if they differ."""
        if all(getattr(self.run, name) == value for name, value in fields.items()):
            return self
        run = self.run.model_copy(update={**fields, "updated_at": sight.time_s})
        return replace(self, run=run).noted(RunChanged(run))

    def moved(self, sight: Sight, state: RunState, reason: Reason | None) -> Flight:
        """Change the state of the run. In the same state, only the reason changes. Raises WrongStateError."""
        if state is self.run.state:
            return self.changed(sight, reason=reason)
        run = self.run.moved_to(state, now=sight.time_s, reason=reason)
        return replace(self, run=run).noted(RunChanged(run))

    def with_record(self, sight: Sight, record: DropRecord) -> Flight:
        """Update the record of a drop in the run if it differs."""
        before = self.run.drop(record.plan_item_id)
        if before == record:
            return self
        flight = replace(self, run=self.run.with_drop(record, now=sight.time_s))
        told = consent_told(record.plan_item_id, before.consent, record.consent)
        return (flight if told is None else flight.noted(told)).noted(RunDrop(record))

    def with_release(self, sight: Sight, release: Release) -> Flight:
        """Update a drop. A finished supervised drop counts as flown."""
        record = release.record
        was_over = self.run.drop(record.plan_item_id).phase is DropPhase.DONE
        flight = replace(self, leg=self.leg.having(release)).with_record(sight, record)
        current, hold_seqs = flight.progress.current, release.compiled.hold_seqs
        at_hold = current is not None and current >= min(hold_seqs)
        if record.alternate_to is not None:  # the mission may have passed it without a visit
            at_hold = current in hold_seqs
        if not (release.is_over and not was_over and release.compiled.supervised and at_hold):
            return flight
        return flight.advanced(sight, flight.progress.also_flown(record.plan_item_id, through_seq=max(hold_seqs)))

    def advanced(self, sight: Sight, progress: MissionProgress) -> Flight:
        """Update the progress. Passed items are stored in the run."""
        flight = replace(self, progress=progress)
        if progress.flown == self.progress.flown and progress.passed_to == self.progress.passed_to:
            return flight
        return flight.changed(sight, flown_item_ids=progress.flown, reached_seq=max(progress.passed_to, 0))

    def flying_to(self, sight: Sight, progress: MissionProgress) -> Flight:
        """Return the same flight, when another item may be current."""
        flight = self.advanced(sight, progress)
        if progress.current == self.progress.current:
            return flight
        flight = flight.noted(RunItem(seq=progress.current, phase="current", item_id=progress.item_id))
        return flight.changed(sight, item_id=progress.item_id)
