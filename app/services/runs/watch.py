"""The flight as it is seen: progress, drops and the run's state follow the vehicle; nothing is commanded here."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from app.domain.complete_sign import CompleteSign
from app.domain.events.run import RunItem
from app.domain.flight_phase import FlightView, how_it_ended, is_airborne, phase_of, why_open
from app.domain.mode_sign import ModeSign
from app.domain.ports import ClockRateTold, ItemReached, LinkFact, MissionCurrent, Rebooted, VehicleLink
from app.domain.progress import Progress
from app.domain.reason import Reason, ReasonCode, because
from app.domain.run import NEXT, Asked, RunState
from app.domain.vehicle import FlightMode, LandedState, VehicleState
from app.domain.vehicle_clock import VehicleClock
from app.services.clock import Clock
from app.services.runs.evidence import Look
from app.services.runs.hands import HandsSign
from app.services.runs.item_clock import ItemClock
from app.services.runs.leg import Leg
from app.services.runs.orders import Order, Release
from app.services.runs.pending_change import SETTLED_S, PendingChange
from app.services.runs.recorder import RunRecorder
from app.services.runs.settings import LAST_REPORTS_S, SLOWEST_HEARTBEAT_S, UNFINISHED_DROPS_S, RunSettings
from app.services.targets import Targets

UNASKED: Final = frozenset({None, Asked.PAUSE, Asked.RESUME, Asked.REFUSED})
"""What a user may have asked for with the mission still being flown to its end."""

OBEYED_IN: Final[dict[Asked | None, FlightMode]] = {
    Asked.PAUSE: FlightMode.HOLD,
    Asked.REFUSED: FlightMode.HOLD,
    Asked.RETURN: FlightMode.RETURN,
    Asked.CONTINGENCY: FlightMode.RETURN,
    Asked.LAND: FlightMode.LAND,
}
"""The mode in which a vehicle does what was asked."""


class FlightWatch:
    """Looks at one vehicle in flight, and never commands it."""

    def __init__(
        self,
        link: VehicleLink,
        leg: Leg,
        recorder: RunRecorder,
        settings: RunSettings,
        clock: Clock,
        targets: Targets,
    ) -> None:
        self._link = link
        self.leg = leg
        self.moving_on = 0
        """Commands that make another item current and are not answered yet: their numbers are of this mission."""
        self._command: Asked | None = None
        """What the vehicle is being told now and has not obeyed yet; as `Run.asked`."""
        self.change: PendingChange | None = None
        """A changed mission that is on its way to the vehicle, or may be on board."""
        self.skip_to = 0
        """The item of a changed mission to which the vehicle had come by itself when it arrived."""
        self.hands = HandsSign(recorder.run.reason)
        self._recorder = recorder
        self._settings = settings
        self._clock = clock
        self._targets = targets
        self._rate = VehicleClock()
        self._progress = Progress.of(leg.mission)
        self._item_clock = ItemClock(leg.mission, recorder)
        self._complete = CompleteSign()
        self._mode = ModeSign()
        self._obeyed: Asked | None = None
        self._mission_done = False
        self._was_airborne = False
        self._was_armed = False
        self._was_away = False
        self._first_look_s: float | None = None
        self._rebooted = False
        self._landed_at_s: float | None = None
        self._connected_at_s = clock.monotonic()
        self._connected_since_s: float | None = None

    def take_up(self, flown: Sequence[str], current: int | None) -> None:
        """Go on where an earlier process stopped looking."""
        reached = self._recorder.run.reached_seq
        passed_to = reached if flown and reached is not None else -1  # PX4 repeats what was reached for ten seconds
        self._progress = replace(self._progress, flown=tuple(flown), passed_to=passed_to)
        self._item_clock.take_up(flown)
        if current is not None:
            self._advance(self._progress.now_current(current))
            self._recorder.change(item_id=self._progress.item_id)
        self._was_airborne = self._was_armed = self._was_away = True

    @contextlib.contextmanager
    def commanding(self, asked: Asked) -> Iterator[None]:
        """While the vehicle is told this: modes on the way are nobody else's."""
        self._command = asked
        try:
            yield
        finally:
            self._command = None

    @property
    def progress(self) -> Progress:
        """How far the mission on board is flown."""
        return self._progress

    @property
    def is_done(self) -> bool:
        """Whether the mission was flown to its end."""
        return self._mission_done

    @property
    def drop_is_busy(self) -> bool:
        """Whether the vehicle waits at a drop or was sent to an alternate, or what a release did is not known yet."""
        open_ones = [release for release in self.leg.releases if not release.is_over]
        return self.moving_on > 0 or any(
            one.is_active or one.is_busy or one.record.alternate_to is not None for one in open_ones
        )

    @property
    def item_is_heard(self) -> bool:
        """Whether MISSION_CURRENT was heard since the link came back, if it was lost."""
        since_s = self._connected_since_s
        return since_s is not None and self._clock.monotonic() - since_s > SETTLED_S

    def take_change(self, change: PendingChange) -> None:
        """The vehicle carries the changed mission: follow that one from here on."""
        ahead = {drop.plan_item_id for drop in change.mission.drops}
        for release in self.leg.releases:
            if not release.is_over and (release.is_busy or release.compiled.plan_item_id not in ahead):
                release.end(because(ReasonCode.PLAN_CHANGED), self._clock.monotonic())
                self._recorder.drop(release.record)  # it was not flown: a change took it out
        self.skip_to = change.first_seq(self.leg.plan, self._progress)
        self.leg = change.begin(self._recorder)
        progress = Progress.of(change.mission)
        self._progress = replace(progress, flown=self._progress.flown, passed_to=self.skip_to - 1)
        self._item_clock.fly_on(change.mission)
        self._complete, self._mission_done, self.change = CompleteSign(), False, None

    def _settle_change(self, change: PendingChange, seen: Look) -> None:
        """Follow the mission that the vehicle names as its own."""
        if change.has_arrived(seen.state):
            self.take_change(change)
        elif change.is_missing(seen.state, self._connected_since_s or seen.now_s, seen.now_s):
            change.is_open = False
            self._recorder.change(changing=None)

    def heard(self, fact: LinkFact) -> None:
        """A fact from the link."""
        match fact:
            case ItemReached():
                if self.change is not None and self.change.is_open:
                    return  # of which mission is not known
                mode = fact.mode or self._link.state().mode
                if mode is FlightMode.MISSION or fact.seq == self._progress.last_seq:
                    if self.leg.mission.is_return(fact.seq):
                        self._fly_to(self._progress.begun(fact.seq))
                    else:
                        item_id = self._progress.plan_item_of.get(fact.seq)
                        self._recorder.note(RunItem(seq=fact.seq, what="reached", item_id=item_id))
                    self._advance(self._progress.reached(fact.seq))
            case MissionCurrent():
                is_open = self.change is not None and self.change.is_open
                if not is_open and fact.mission_id == self._recorder.run.mission_id:
                    self._shown(fact.seq, fact.mode)
            case Rebooted():
                self._rebooted = True
            case ClockRateTold():
                self._rate = self._rate.told(fact.rate)

    def now(self) -> Look:
        """The vehicle at this moment."""
        return Look(
            self._link.state(),
            self._clock.monotonic(),
            self._clock.now(),
            self._rate.rate,
            self._rate.is_measured,
            self._recorder.run.asked,
            is_changing=self.change is not None and self.change.is_open,
            targets=self._targets.fixes(self.leg.feeds),
        )

    def look(self) -> tuple[Order, ...]:
        """Look once: update the run, and say what must be sent now."""
        seen = self.now()
        if seen.state.connected and seen.state.boot_time_s is not None and seen.state.position_age_s is not None:
            self._rate = self._rate.seen(seen.now_s - seen.state.position_age_s, seen.state.boot_time_s)
        if not seen.state.connected:
            self._was_away = self._was_airborne  # it may have flown on to its end, unseen
            self._pass_time(seen)
            self._look_at_silence(seen)
            self._connected_since_s = None
            return ()
        if self.change is not None:
            self._settle_change(self.change, seen)
            seen = self.now()
        if self._connected_since_s is None:
            self._connected_since_s = -math.inf if self._first_look_s is None else seen.now_s
        self._connected_at_s = seen.now_s
        if self._rebooted:
            self.end(RunState.FAILED, because(ReasonCode.REBOOTED))
            return ()
        self._mode = self._mode.seen(seen.state, seen.now_s)
        self._was_airborne = self._was_airborne or is_airborne(seen.state)
        self._first_look_s = seen.now_s if self._first_look_s is None else self._first_look_s
        late = seen.now_s - self._first_look_s > SLOWEST_HEARTBEAT_S
        self._was_armed = self._was_armed or bool(seen.state.armed) or late
        self._follow_mission(seen.state)
        orders = self._look_at_drops(seen)
        self._item_clock.look(seen, self._progress, self.leg.releases, was_airborne=self._was_airborne)
        self._follow_phase(seen)
        return orders

    def _follow_mission(self, state: VehicleState) -> None:
        flew_unseen = self._progress.is_behind(state, self._recorder.run.mission_id)
        if state.mission_seq is not None and (state.mode is FlightMode.MISSION or flew_unseen):
            self._was_away = self._was_away and state.mode is not FlightMode.MISSION
            self._fly_to(self._progress.now_current(state.mission_seq))
        elif state.mission_seq is not None and state.mission_id == self._recorder.run.mission_id:
            self._shown(state.mission_seq, state.mode)
        near_end = self._progress.current == self._progress.last_seq or self._progress.is_complete
        near_end = near_end or (self._was_away and state.mission_id == self._recorder.run.mission_id)
        self._complete = self._complete.seen(state)
        self._settle_asked(state)
        unasked = self._recorder.run.asked in UNASKED
        if near_end and unasked and self._complete.says_done(state, last_seq=self._progress.last_seq):
            self._advance(self._progress.completed())
        if self._progress.is_complete and unasked:
            self._mission_done = True

    def _settle_asked(self, state: VehicleState) -> None:
        """What was asked explains one obedience: a vehicle that then flies its mission on was told so by somebody."""
        asked = self._recorder.run.asked
        self._obeyed = asked if state.mode is OBEYED_IN.get(asked) else self._obeyed
        in_air = state.landed is not LandedState.ON_GROUND and self._mode.is_settled(self._clock.monotonic())
        goes_on = self._obeyed == asked and in_air  # PX4 may be in Mission for a moment as it lands
        if asked and state.mode is FlightMode.MISSION and (asked is Asked.RESUME or goes_on):
            self._recorder.change(asked=None)
        if not self._recorder.run.asked:
            self._obeyed = None

    def _shown(self, seq: int, mode: FlightMode | None) -> None:
        """MISSION_CURRENT. The mode of a return is told apart from its item, and may come first."""
        returns = mode is FlightMode.RETURN and self._was_airborne and self.leg.mission.is_return(seq)
        if mode is FlightMode.MISSION or returns:
            self._fly_to(self._progress.now_current(seq))

    def divert(self, plan_item_id: str) -> None:
        """The vehicle is about to be sent to this drop's alternate: from now on the drop there is looked at too."""
        self.leg = self.leg.diverted(plan_item_id)
        self._recorder.change(drops=(*self._recorder.run.drops, self.leg.alternates[plan_item_id].record))

    def _look_at_drops(self, seen: Look) -> tuple[Order, ...]:
        orders: list[Order] = []
        for release in self.leg.releases:
            if release.is_over:
                continue
            orders += release.look(seen, self._progress)
            self.record(release)
        return tuple(orders)

    def _pass_time(self, seen: Look) -> None:
        """What does not wait for the link."""
        for release in self.leg.supervised:
            if not release.is_over:
                release.silent(seen)
                self.record(release)

    def record(self, release: Release) -> None:
        """Take a drop's new record in; a supervised drop that is over counts as flown."""
        was_over = self._recorder.run.drop(release.record.plan_item_id).phase == "done"
        self._recorder.drop(release.record)
        current, hold_seqs = self._progress.current, release.compiled.hold_seqs
        at_hold = current is not None and current >= min(hold_seqs)
        if release.record.alternate_to is not None:  # the mission may have gone on past it without a visit
            at_hold = current in hold_seqs
        if release.is_over and not was_over and release.compiled.supervised and at_hold:
            through = max(hold_seqs)
            self._advance(self._progress.also_flown(release.record.plan_item_id, through_seq=through))

    def _follow_phase(self, seen: Look) -> None:
        view = FlightView(
            state=seen.state,
            vehicle_type=self.leg.plan.vehicle_type,
            at_drop=any(release.is_active for release in self.leg.releases),
            mission_done=self._mission_done,
            was_airborne=self._was_airborne,
            asked=self._recorder.run.asked,
            command=self._command,
            was_armed=self._was_armed,
            after_hands=self.hands.look(seen.state.mode),
            at_last_item=self._progress.current == self._progress.last_seq,
            mode_is_settled=self._mode.is_settled(seen.now_s),
            by_failsafe=self._mode.by_failsafe,
            was_returning=self._recorder.run.state is RunState.RETURNING,
            rally_point=None if self._recorder.run.rally is None else self._recorder.run.rally.index + 1,
            asks_consent_to=next((r.record.plan_item_id for r in self.leg.supervised if r.is_asking), ""),
        )
        phase, reason = phase_of(view)
        if phase is not RunState.LANDED:
            self._landed_at_s = None
            if phase in NEXT[self._recorder.run.state] or phase is self._recorder.run.state:
                self._recorder.move(phase, reason)
            return
        if phase not in NEXT[self._recorder.run.state] and self._recorder.run.state is not RunState.LANDED:
            self.end(RunState.FAILED, reason or because(ReasonCode.NOT_TAKEN_OFF))  # taken up during its start
            return
        if self._landed_at_s is None:
            self._landed_at_s = seen.now_s
            self._recorder.move(RunState.LANDED, reason)
        if not self._waits_for_reports(seen.now_s - self._landed_at_s):
            last, why = how_it_ended(mission_done=self._mission_done, asked=self._recorder.run.asked, reason=reason)
            self.end(last, why)

    def _waits_for_reports(self, landed_s: float) -> bool:
        """The heartbeat that says disarmed may overtake the report that the last item was reached."""
        if not self._mission_done and self._recorder.run.asked in UNASKED and landed_s < LAST_REPORTS_S:
            return True
        return landed_s < UNFINISHED_DROPS_S and any(release.awaits_answer for release in self.leg.supervised)

    def _look_at_silence(self, seen: Look) -> None:
        silent_s = seen.now_s - self._connected_at_s
        if silent_s > self._settings.lost_after_s:
            self.end(RunState.LOST, because(ReasonCode.NOT_HEARD, silent_s=silent_s))

    def end(self, state: RunState, reason: Reason | None) -> None:
        """The run's last state: every drop that is still open ends with it."""
        for release in self.leg.releases:
            if not release.is_over:
                release.end(why_open(state, reason), self._clock.monotonic())
                self.record(release)
        self._recorder.change(item_id=None)
        self._recorder.move(state, reason)

    def _advance(self, progress: Progress) -> None:
        if progress.flown != self._progress.flown or progress.passed_to != self._progress.passed_to:
            self._recorder.change(flown_item_ids=progress.flown, reached_seq=max(progress.passed_to, 0))
        self._progress = progress

    def _fly_to(self, progress: Progress) -> None:
        before = self._progress.current
        self._advance(progress)
        if self._progress.current != before:
            self._recorder.note(RunItem(seq=self._progress.current, what="current", item_id=self._progress.item_id))
            self._recorder.change(item_id=self._progress.item_id)
