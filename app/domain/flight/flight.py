"""The state of one flight. See step.py for what changes it."""

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

# Whether a run is paused because its vehicle was in offboard control, and not because somebody asked for the pause.


@dataclass(frozen=True, slots=True)
class OffboardTracker:
    """The way into offboard control asks for a pause; who leaves it to Hold asks again, and the dead-man does not.

    `had_it`: the vehicle was in offboard control since anything was asked for. `mode` is that of the last look.
    """

    had_it: bool = False
    mode: FlightMode | None = None

    def asked(self) -> OffboardTracker:
        """A user asks for something now: what comes of it is as asked, also before the vehicle has obeyed."""
        return OffboardTracker(False, self.mode)

    def seen(self, mode: FlightMode | None) -> OffboardTracker:
        """After a look at a connected vehicle."""
        had_it = self.had_it
        if mode is FlightMode.OFFBOARD and self.mode is not FlightMode.OFFBOARD:
            had_it = True
        elif mode not in (FlightMode.OFFBOARD, FlightMode.HOLD, None):
            had_it = False
        return OffboardTracker(had_it, mode)


# Notes when each item of a flight began and ended, on the vehicle's clock, as events of the run.


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
        self,
        seen: VehicleSnapshot,
        progress: MissionProgress,
        releases: Iterable[Release],
        *,
        was_airborne: bool,
        is_paused: bool,
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


def _was_ordered_now(release: Release, progress: MissionProgress) -> bool:
    """The vehicle waits at this drop, and its release was ordered, or an operator is asked for it."""
    waits = progress.current in release.compiled.hold_seqs
    return release.compiled.supervised and waits and release.record.phase in (DropPhase.ASKING, DropPhase.RELEASING)


def _has_landed(state: VehicleState) -> bool:
    return state.landed is LandedState.ON_GROUND or state.armed is False


def _vehicle_s(seen: VehicleSnapshot) -> float | None:
    """The vehicle's clock now: the newest position's, and what has passed since."""
    state = seen.state
    if state.boot_time_s is None or state.position_age_s is None:
        return None
    return state.boot_time_s + state.position_age_s * seen.clock_rate


LOST_AFTER_S: Final = 900.0
DEFAULT_MAX_OFFSET_M: Final = 3.0


@dataclass(frozen=True, slots=True)
class Flight:
    """One run in flight.

    `leg` is what is flown, `progress` how far; `change` a changed mission that is on its way to the vehicle, or may be
    on board, and `skip_to` its item to which the vehicle had come by itself when it arrived. `command` is what the
    vehicle is being told now, as `run.asked`; `obeyed` what was asked of it and seen to be done. `moving_on` counts the
    commands that make another item current and are not answered yet. `was_away`: it may have flown on unseen.
    `seen` is the vehicle at the last look. `connected_at_s` is when it was last heard, `connected_since_s` since when
    without a gap. `effects` are those of the step under way.
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
        """Before the first look, at our monotonic time. A recovered run's reason tells of offboard control."""
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
        """Whether it is not known which of two missions the vehicle flies."""
        return self.change is not None and self.change.is_open

    @property
    def drop_is_busy(self) -> bool:
        """Whether the vehicle waits at a drop or was sent to an alternate, or what a release did is not known yet."""
        open_ones = [release for release in self.leg.releases if not release.is_over]
        return self.moving_on > 0 or any(
            one.is_active or one.is_busy or one.record.alternate_to is not None for one in open_ones
        )

    def item_is_heard(self, now_s: float) -> bool:
        """Whether MISSION_CURRENT was heard since the link came back, if it was lost."""
        return self.connected_since_s is not None and now_s - self.connected_since_s > SETTLED_S

    def look(self, sight: Sight) -> VehicleSnapshot:
        """A sight with what the flight knows of the vehicle's clock, and of what is asked."""
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
        """A drop of the leg with this number; None once the plan was changed."""
        return self.leg.find(plan_item_id) if leg == self.run.changes else None

    def noted(self, payload: AnyPayload) -> Flight:
        """With one more event to be stored."""
        return replace(self, effects=(*self.effects, Record(payload)))

    def ordering(self, orders: tuple[Order, ...]) -> Flight:
        """With orders to be sent."""
        return replace(self, effects=(*self.effects, *orders)) if orders else self

    def changed(self, sight: Sight, **fields: Any) -> Flight:
        """With other fields of the run, if they differ."""
        if all(getattr(self.run, name) == value for name, value in fields.items()):
            return self
        run = self.run.model_copy(update={**fields, "updated_at": sight.time_s})
        return replace(self, run=run).noted(RunChanged(run))

    def moved(self, sight: Sight, state: RunState, reason: Reason | None) -> Flight:
        """The run in its next state; staying in it only changes the reason. Raises WrongStateError."""
        if state is self.run.state:
            return self.changed(sight, reason=reason)
        run = self.run.moved_to(state, now=sight.time_s, reason=reason)
        return replace(self, run=run).noted(RunChanged(run))

    def with_record(self, sight: Sight, record: DropRecord) -> Flight:
        """With the new record of one drop in the run, if it differs."""
        before = self.run.drop(record.plan_item_id)
        if before == record:
            return self
        flight = replace(self, run=self.run.with_drop(record, now=sight.time_s))
        told = consent_told(record.plan_item_id, before.consent, record.consent)
        return (flight if told is None else flight.noted(told)).noted(RunDrop(record))

    def with_release(self, sight: Sight, release: Release) -> Flight:
        """With a drop as it is now; a supervised drop that is over counts as flown."""
        record = release.record
        was_over = self.run.drop(record.plan_item_id).phase is DropPhase.DONE
        flight = replace(self, leg=self.leg.having(release)).with_record(sight, record)
        current, hold_seqs = flight.progress.current, release.compiled.hold_seqs
        at_hold = current is not None and current >= min(hold_seqs)
        if record.alternate_to is not None:  # the mission may have gone on past it without a visit
            at_hold = current in hold_seqs
        if not (release.is_over and not was_over and release.compiled.supervised and at_hold):
            return flight
        return flight.advanced(sight, flight.progress.also_flown(record.plan_item_id, through_seq=max(hold_seqs)))

    def advanced(self, sight: Sight, progress: MissionProgress) -> Flight:
        """With the progress; what was passed is of the run."""
        flight = replace(self, progress=progress)
        if progress.flown == self.progress.flown and progress.passed_to == self.progress.passed_to:
            return flight
        return flight.changed(sight, flown_item_ids=progress.flown, reached_seq=max(progress.passed_to, 0))

    def flying_to(self, sight: Sight, progress: MissionProgress) -> Flight:
        """The same, when another item may be current."""
        flight = self.advanced(sight, progress)
        if progress.current == self.progress.current:
            return flight
        flight = flight.noted(RunItem(seq=progress.current, phase="current", item_id=progress.item_id))
        return flight.changed(sight, item_id=progress.item_id)
