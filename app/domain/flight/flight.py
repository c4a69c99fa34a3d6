"""The state of a flight. step.py changes it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from app.domain.drop.record import DropPhase, DropRecord
from app.domain.events import AnyPayload
from app.domain.events.run import RunChanged, RunDrop, RunItem, RunItemEnded, consent_event
from app.domain.flight.following import TargetTracker
from app.domain.flight.inputs import (
    SETTLED_S,
    FlightCommand,
    FlightEffect,
    Observation,
    PendingChange,
    RecordEvent,
    Recovered,
)
from app.domain.flight.landing import RETURNS, HeightTracker, Touchdown, is_near
from app.domain.flight.modes import ModeTracker
from app.domain.flight.phase import STOPPED_M_S, failsafe_of, is_airborne, is_offboard_reason
from app.domain.flight.progress import ItemTimes, MissionCompleteDetector, MissionProgress
from app.domain.flight.segment import MissionSegment, Release
from app.domain.flight.snapshot import VehicleSnapshot
from app.domain.flight.trackers import (
    CommandTracker,
    HomeTracker,
    LinkTracker,
    LostMissionTracker,
    OffboardTracker,
    OtherMissionTracker,
)
from app.domain.mission import Mission
from app.domain.model import changed
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import LastPosition, Run, RunState
from app.domain.vehicle.clock import UNMEASURED, VehicleClock
from app.domain.vehicle.state import (
    WITHOUT_FIX,
    FlightMode,
    LandedState,
    VehicleState,
    VehicleType,
    names_other_mission,
)

# Records start and end of each item of a flight, on the vehicle's clock, as events of the run.


LONGEST_GAP_S: Final = 2.0
"""Of ours: what ended while nothing was heard for longer has no time."""


@dataclass(frozen=True, slots=True)
class ItemClock:
    """`observed_s` is our time of the last observation, `now_s` the vehicle's. What is first seen until `unseen_to_s`
    may have ended before. `left_hold` are the seqs of a hold in which a restart of the service found the vehicle: the
    next item begins as it is left.
    """

    plan_item_of: Mapping[int, str]
    times: ItemTimes
    is_running: bool = False
    observed_s: float | None = None
    now_s: float | None = None
    unseen_to_s: float = -math.inf
    left_hold: tuple[int, ...] = ()

    @classmethod
    def of(cls, mission: Mission) -> ItemClock:
        """Before the flight."""
        return cls(mission.plan_item_of, ItemTimes.of(mission))

    def recovered(self, recovered: Recovered, releases: Iterable[Release]) -> ItemClock:
        """Another process observed the first items, and the start of the current one was not observed. Of a release
        that it commanded, or asked for, it has told that the item where the vehicle waits is over.
        """
        supervised = [one for one in releases if one.compiled.supervised]
        begun = any(one.record.phase in _BEGUN and self._anchor_of(one) is not None for one in supervised)
        held = [one.compiled.hold_seqs for one in supervised if recovered.current in one.compiled.hold_seqs]
        return replace(
            self,
            times=self.times.recovered(len(recovered.flown), ahead=begun),
            is_running=True,
            unseen_to_s=recovered.observed.now_s + SETTLED_S,
            left_hold=tuple(seq for seqs in held for seq in seqs),
        )

    def flown_on(self, mission: Mission) -> ItemClock:
        """The plan was changed in flight. Its first item starts now, even if the vehicle was already flying to it."""
        return replace(self, plan_item_of=mission.plan_item_of, times=self.times.flown_on(mission, self.now_s))

    def observe(
        self,
        seen: VehicleSnapshot,
        progress: MissionProgress,
        releases: Iterable[Release],
        *,
        was_airborne: bool,
        is_paused: bool,
        is_just_back: bool,
    ) -> tuple[ItemClock, tuple[RunItemEnded, ...]]:
        """After each observation of a vehicle that is heard. `is_paused`: as it was the time before, and still is.
        `is_just_back`: see LinkTracker.
        """
        now_s, times = _vehicle_s(seen), self.times
        if self.now_s is not None and now_s is not None and is_paused:
            times = times.paused(now_s - self.now_s)
        gap = is_just_back or (self.observed_s is not None and seen.now_s - self.observed_s > LONGEST_GAP_S)
        gap = gap or seen.now_s <= self.unseen_to_s
        if not self.is_running:
            times = times.started(now_s)
        landed = was_airborne and _has_landed(seen.state)
        times, ended = times.seen(progress, now_s, landed=landed, gap=gap)
        for release in releases:
            anchor_id = self._anchor_of(release)
            if anchor_id is not None and _is_released_now(release, progress):
                times, more = times.releases(anchor_id, now_s)
                ended += more
        left_hold = self.left_hold
        if left_hold and not times.ahead:  # the drop is over, and the vehicle may wait on
            waits = progress.current in left_hold
            times = times.beginning(None if gap or waits else now_s)
            left_hold = left_hold if waits else ()
        after = replace(self, times=times, is_running=True, observed_s=seen.now_s, now_s=now_s, left_hold=left_hold)
        return after, ended

    def _anchor_of(self, release: Release) -> str | None:
        """The item where the vehicle waits at a drop; None if that is the drop itself."""
        anchor_id = self.plan_item_of.get(release.compiled.hold_seqs[-1])
        return None if anchor_id == release.compiled.plan_item_id else anchor_id


_BEGUN: Final = (DropPhase.ASKING, DropPhase.RELEASING)


def _is_released_now(release: Release, progress: MissionProgress) -> bool:
    """The vehicle waits at this drop, and its release was commanded, or an operator is asked for it."""
    waits = progress.current in release.compiled.hold_seqs
    return release.compiled.supervised and waits and release.record.phase in _BEGUN


def _has_landed(state: VehicleState) -> bool:
    return state.landed is LandedState.ON_GROUND or state.armed is False


def _vehicle_s(seen: VehicleSnapshot) -> float | None:
    """The vehicle's time now: that of the newest position plus the time since."""
    state = seen.state
    if state.boot_time_s is None or state.position_age_s is None:
        return None
    return state.boot_time_s + state.position_age_s * seen.clock_rate


_MODES_OF_A_START: Final = frozenset({FlightMode.HOLD, FlightMode.MISSION, FlightMode.TAKEOFF})
"""In any other, somebody else has it."""
LOST_AFTER_S: Final = 900.0
DEFAULT_MAX_OFFSET_M: Final = 3.0


@dataclass(frozen=True, slots=True)
class Flight:
    """The state of the reducer: one run, before and during its flight. `run.state` is its phase.

    `segment` is the mission that is flown, `progress` the progress in it. `change` is a changed mission that is being
    transferred or may be on board, and `skip_to` its item that the vehicle had reached when the change arrived.
    `target` follows the moving target of the next drop. `last_state` is the vehicle's state at the last observation.
    `touchdown` is how it came to stand on the ground; None in the air. `in_sight` is the last observation before that
    on a link that held: what comes first after a loss is partly from before. `height` has the altitudes of its last
    seconds. `is_on_mission`: it was seen in Mission mode, and since then in that and Hold mode only.
    `cancelled_failsafe` is what the last command, a pause, was commanded amid. `effects` are those of the current step.
    """

    run: Run
    segment: MissionSegment
    progress: MissionProgress
    item_clock: ItemClock
    link: LinkTracker
    lost_after_s: float = LOST_AFTER_S
    default_max_offset_m: float = DEFAULT_MAX_OFFSET_M
    offboard: OffboardTracker = field(default_factory=OffboardTracker)
    completion: MissionCompleteDetector = field(default_factory=MissionCompleteDetector)
    mode: ModeTracker = field(default_factory=ModeTracker)
    clock: VehicleClock = UNMEASURED
    command: CommandTracker = field(default_factory=CommandTracker)
    target: TargetTracker = field(default_factory=TargetTracker)
    other_mission: OtherMissionTracker = field(default_factory=OtherMissionTracker)
    lost_mission: LostMissionTracker = field(default_factory=LostMissionTracker)
    home: HomeTracker = field(default_factory=HomeTracker)
    cancelled_failsafe: Reason | None = None
    change: PendingChange | None = None
    skip_to: int = 0
    mission_done: bool = False
    was_airborne: bool = False
    was_armed: bool = False
    last_state: VehicleState | None = None
    landed_at_s: float | None = None
    touchdown: Touchdown | None = None
    in_sight: VehicleState | None = None
    height: HeightTracker = field(default_factory=HeightTracker)
    is_on_mission: bool = False
    effects: tuple[FlightEffect, ...] = ()

    @classmethod
    def of(
        cls, run: Run, segment: MissionSegment, now_s: float, lost_after_s: float, default_max_offset_m: float
    ) -> Flight:
        """Before the first observation, at our monotonic time. A recovered run's reason shows offboard control."""
        return cls(
            run,
            segment,
            MissionProgress.of(segment.mission),
            ItemClock.of(segment.mission),
            LinkTracker(now_s),
            lost_after_s,
            default_max_offset_m,
            OffboardTracker(is_offboard_reason(run.reason)),
            cancelled_failsafe=None if run.state is not RunState.PAUSED else failsafe_of(run.reason),
        )

    @property
    def is_changing(self) -> bool:
        """Whether it is unknown which of two missions the vehicle flies."""
        return self.change is not None and self.change.is_open

    def names_other(self, state: VehicleState) -> bool:
        """Whether another client has replaced the mission: nothing of it counts, and nothing is sent into it."""
        return not self.is_changing and names_other_mission(state, self.run.mission_id)

    def flies_mission_in(self, mode: FlightMode | None) -> bool:
        """Whether MISSION_CURRENT is of the mission: a return that was commanded may show in it before its mode."""
        return mode is FlightMode.MISSION and self.run.commanded not in RETURNS

    def is_of_mission(self, seq: int, mode: FlightMode | None) -> bool:
        """Whether the mission itself may have made this item current, and no return that leads to its landing."""
        return mode is not FlightMode.RETURN or self.segment.mission.is_return(seq)

    @property
    def resumes_at(self) -> int | None:
        """The item to make current before the mission is resumed, which the vehicle would not fly to by itself.

        A return may have made the mission's landing current (PX4, RTL_TYPE 1 to 4); and a drop that has ended while
        the vehicle was paused in its hold would be waited for again.
        """
        current = self.progress.current
        if self.mode.has_returned:
            return current
        ended = (release.compiled for release in self.segment.supervised if release.is_over)
        return next((drop.resume_seq for drop in ended if current in drop.hold_seqs), None)

    def is_at_last_item(self, state: VehicleState) -> bool:
        """Whether the mission's last item is flown, or the place before its return is reached: PX4 holds for a moment
        in between.
        """
        current, mission = self.progress.current, self.segment.mission
        if current == self.progress.last_seq or current is None:
            return current is not None
        is_flying = mission.ends_with_return and self.run.state is RunState.FLYING
        return is_flying and current >= mission.last_place_seq and is_near(state, mission.items[mission.last_place_seq])

    @property
    def is_in_final_return(self) -> bool:
        """Whether only the return at the mission's end is left. PX4 does not resume it: its mission is finished."""
        current = self.progress.current  # another station may have made an earlier item current
        is_last = current == self.progress.last_seq or (current is None and self.mission_done)
        return self.segment.mission.ends_with_return and is_last

    @property
    def is_down(self) -> bool:
        """Whether it stands on the ground where another mode than the mission's brought it down."""
        return self.touchdown is not None and not self.touchdown.is_by_mission

    @property
    def why_elsewhere(self) -> Reason | None:
        """Why it did not land at its destination: see Touchdown."""
        if self.touchdown is None or not self.segment.mission.items:
            return None
        vehicle_type = self.segment.plan.vehicle_type
        return self.touchdown.why_elsewhere(self.segment.mission, self.run.commanded, vehicle_type)

    @property
    def is_left_at_start(self) -> bool:
        """Whether a restart of the service broke its start off, and the vehicle has been where it was armed since."""
        return self.run.reason == Reason.of(ReasonCode.RESTART_DURING_START_ARMED)

    def stands_at_start(self, state: VehicleState) -> bool:
        """Whether it stands armed where it was to start, in a mode of its start. A rover says soon that it is in the
        air.
        """
        if not state.connected or state.armed is not True or state.mode not in _MODES_OF_A_START:
            return False
        if self.segment.plan.vehicle_type is VehicleType.ROVER:
            speed_m_s = state.ground_speed_m_s
            return self.is_left_at_start and speed_m_s is not None and speed_m_s < STOPPED_M_S
        return not self.was_airborne and state.landed is LandedState.ON_GROUND

    def why_fallen(self, state: VehicleState) -> Reason | None:
        """Why it did not land at all: see Touchdown."""
        if self.touchdown is None:
            return None
        if state.is_terminated and self.touchdown.is_by_mission and not self.mission_done:
            return Reason.of(ReasonCode.TERMINATED)  # HEARTBEAT came after the ground
        return self.touchdown.why_fallen(state, self.segment.plan.vehicle_type)

    def having_taken_off(self, observed: Observation) -> Flight:
        """With home as it was when the vehicle was first seen in the air, and as it was moved since."""
        home, flight = observed.state.home, self
        if home is None or not is_airborne(observed.state):
            return self
        if self.run.home is None:
            flight = self.with_run(observed, home=home)
        if flight.segment.plan.vehicle_type is VehicleType.ROVER:
            return flight  # PX4 itself moves home of a rover
        took_off_from = flight.run.home or home
        told = flight.home.seen(took_off_from, home)
        if observed.state.landed is LandedState.TAKING_OFF:  # that of the arming is told up to a second later
            told = HomeTracker()
        if not told.moved_m and home.altitude_m != took_off_from.altitude_m:  # in the run, for a restart
            flight = flight.with_run(observed, home=replace(took_off_from, altitude_m=home.altitude_m))
        return replace(flight, home=told)

    def having_landed(self, state: VehicleState) -> Flight:
        """After an observation of a connected vehicle. One whose mission was done while the link was lost has flown.
        A landing on the way may have been followed by another one in a loss of the link, the last one not.
        """
        is_back = self.link.is_just_back
        has_flown = self.was_airborne or (is_back and self.mission_done)
        if is_airborne(state) or not has_flown:
            height = HeightTracker() if is_back else self.height.in_air(state)
            return replace(self, touchdown=None, in_sight=self.in_sight if is_back else state, height=height)
        if state.landed is not LandedState.ON_GROUND:
            return self
        found, restarted = self.touchdown, self.in_sight is None and self.link.was_away
        if found is None:
            is_seen = not (is_back or restarted)
            reason, home, from_m = self.run.reason, self.run.home, self.height.highest_m(state) if is_seen else None
            found = Touchdown.of(state, self.in_sight, reason, is_seen=is_seen, took_off_from=home, from_m=from_m)
        elif is_back and not self.mission_done:
            found = found.lost_sight_of(state)
        return replace(self, was_airborne=True, touchdown=found.located(state))

    def having_driven(self, state: VehicleState) -> Flight:
        """After an observation of a connected vehicle. What was not seen before the mission was done is not on it."""
        begins = state.mode is FlightMode.MISSION and not self.mission_done
        stays = self.is_on_mission and state.mode in (FlightMode.MISSION, FlightMode.HOLD)
        return changed(self, is_on_mission=(begins or stays) and not state.in_failsafe)

    @property
    def drop_is_busy(self) -> bool:
        """Whether the vehicle waits at a drop, was sent to an alternate, or the result of a release is not known
        yet.
        """
        open_ones = [release for release in self.segment.releases if not release.is_over]
        return self.command.moving_on > 0 or any(
            one.is_active or one.is_busy or one.record.alternate_to is not None for one in open_ones
        )

    def current_item_is_fresh(self, now_s: float) -> bool:
        """Whether MISSION_CURRENT was received since the link was restored, if it was lost."""
        since_s = self.link.connected_since_s
        return since_s is not None and now_s - since_s > SETTLED_S

    def snapshot(self, observed: Observation) -> VehicleSnapshot:
        """Return an observation with what the flight knows of the vehicle's clock and of pending commands."""
        return VehicleSnapshot(
            observed.state,
            observed.now_s,
            observed.time_s,
            self.clock.rate,
            self.clock.is_measured,
            self.run.commanded,
            is_changing=self.is_changing,
            carries_other=self.names_other(observed.state),
            home_moved_m=self.home.moved_m,
            targets=observed.targets,
        )

    def find(self, plan_item_id: str, segment: int) -> Release | None:
        """A drop of the segment with this number; None once the plan was changed."""
        return self.segment.find(plan_item_id) if segment == self.run.changes else None

    def recording(self, payload: AnyPayload) -> Flight:
        """With one more event to be stored."""
        return replace(self, effects=(*self.effects, RecordEvent(payload)))

    def commanding(self, *commands: FlightCommand) -> Flight:
        return replace(self, effects=(*self.effects, *commands)) if commands else self

    def with_run(self, observed: Observation, **fields: Any) -> Flight:
        """With other fields of the run, if they differ."""
        if all(getattr(self.run, name) == value for name, value in fields.items()):
            return self
        run = self.run.model_copy(update={**fields, "updated_at": observed.time_s})
        return replace(self, run=run).recording(RunChanged(run))

    def in_state(self, observed: Observation, state: RunState, reason: Reason | None) -> Flight:
        """The run in its next state; staying in it only changes the reason. Raises WrongStateError."""
        if state is self.run.state:
            return self.with_run(observed, reason=reason)
        run = self.run.moved_to(state, now=observed.time_s, reason=reason)
        return replace(self, run=run).recording(RunChanged(run))

    def ended(self, observed: Observation, state: RunState, reason: Reason | None) -> Flight:
        """The run in its last state, with the place where somebody may have to look for the vehicle."""
        changes = {"item_id": None, "last_position": _last_position(observed)}
        run = self.run.model_copy(update=changes).moved_to(state, now=observed.time_s, reason=reason)
        return replace(self, run=run).recording(RunChanged(run))

    def with_record(self, observed: Observation, record: DropRecord) -> Flight:
        """With the new record of one drop in the run, if it differs."""
        before = self.run.drop(record.plan_item_id)
        if before == record:
            return self
        flight = replace(self, run=self.run.with_drop(record, now=observed.time_s))
        consent = consent_event(record.plan_item_id, before.consent, record.consent)
        return (flight if consent is None else flight.recording(consent)).recording(RunDrop(record))

    def with_release(self, observed: Observation, release: Release, *, at_end: bool = False) -> Flight:
        """Return the flight with this drop; a supervised drop that has ended counts as flown.

        `at_end`: the run closes it. Then it only counts if the vehicle was there, not if it was on the way.
        """
        record = release.record
        was_over = self.run.drop(record.plan_item_id).phase is DropPhase.DONE
        flight = replace(self, segment=self.segment.having(release)).with_record(observed, record)
        current, hold_seqs = flight.progress.current, release.compiled.hold_seqs
        at_hold = current is not None and current >= min(hold_seqs)
        if record.alternate_to is not None:  # the mission may have passed it without a visit
            at_hold = current in hold_seqs
        was_there = record.attempts > 0 or flight.progress.passed_to >= max(hold_seqs)
        counts = at_hold and (was_there or not at_end)
        if not (release.is_over and not was_over and release.compiled.supervised and counts):
            return flight
        flown = flight.progress.also_flown(record.plan_item_id, through_seq=max(hold_seqs))
        return flight.with_progress(observed, flown)

    def with_progress(self, observed: Observation, progress: MissionProgress) -> Flight:
        """Return the flight with this progress; the run records the items that were passed."""
        flight = changed(self, progress=progress)
        if progress.flown == self.progress.flown and progress.passed_to == self.progress.passed_to:
            return flight
        return flight.with_run(observed, flown_item_ids=progress.flown, reached_seq=max(progress.passed_to, 0))

    def flying_to(self, observed: Observation, progress: MissionProgress) -> Flight:
        """The same, when another item may be current."""
        flight = self.with_progress(observed, progress)
        if progress.current == self.progress.current:
            return flight
        flight = flight.recording(RunItem(seq=progress.current, phase="current", item_id=progress.item_id))
        return flight.with_run(observed, item_id=progress.item_id)


def _last_position(observed: Observation) -> LastPosition | None:
    state = observed.state
    if state.latitude_deg is None or state.longitude_deg is None or state.position_age_s is None:
        return None
    at = observed.time_s - state.position_age_s
    is_estimated = state.gnss_fix in WITHOUT_FIX
    place = {"latitude_deg": state.latitude_deg, "longitude_deg": state.longitude_deg}
    return LastPosition(**place, at=at, is_estimated=is_estimated)
