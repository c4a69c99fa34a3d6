"""The only function that changes a flight. It has no clock, link or disk: the same inputs give the same flight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter
from typing import Any, Final

from app.domain.drop.record import DropOutcome, GripperUse
from app.domain.events.run import RunChanged, RunTargetNotFollowed
from app.domain.flight import inputs
from app.domain.flight.change import (
    change_arrived,
    change_begun,
    change_refused,
    change_transfer_ended,
    change_withdrawn,
    settle_change,
)
from app.domain.flight.embedded_release import EmbeddedRelease
from app.domain.flight.flight import Flight
from app.domain.flight.following import TargetTracker
from app.domain.flight.inputs import FlightEffect, FlightInput, Observation
from app.domain.flight.on_mission import OBEYED_IN, STAYS_ON_MISSION, follow_mission, item_reached, item_shown
from app.domain.flight.phase import (
    PhaseFacts,
    failsafe_of,
    final_state,
    is_airborne,
    is_landing_unsure,
    phase_of,
    reason_left_open,
)
from app.domain.flight.snapshot import offset_m
from app.domain.flight.supervised_release import ReleaseStep, SupervisedRelease
from app.domain.model import changed
from app.domain.plan.intercept import follower_at
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import NEXT, NOT_STARTED, RunAction, RunState
from app.domain.vehicle.facts import ClockRateSet, ItemReached, MissionCurrent, Rebooted, StatusText
from app.domain.vehicle.link_security import weaker
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState

UNFINISHED_DROPS_S: Final = 5.0
"""After a landing: maximum time for the answer to a release in progress."""

SLOWEST_HEARTBEAT_S: Final = 3.0
"""After a start: maximum time for a HEARTBEAT that reports arming, if some are lost."""

LAST_REPORTS_S: Final = 2.5
"""After a landing: maximum time for the report that the mission is complete. MISSION_CURRENT is sent at 1 Hz."""

DISARMED_WITHIN_S: Final = 15.0
"""A run whose vehicle is left armed waits so long for its disarming, and then ends without. All attempts take less."""


def step(flight: Flight, given: FlightInput) -> tuple[Flight, tuple[FlightEffect, ...]]:
    """The flight after an input, and what is to be stored and sent now, in this order. After the end nothing changes.

    Raises:
        WrongStateError: the run cannot reach the state that the input names.
    """
    if flight.run.is_over:
        return flight, ()
    after = _STEPS[type(given)](flight, given)
    return changed(after, effects=()), after.effects


# Observations and facts.


def _observed(flight: Flight, given: inputs.Observed) -> Flight:
    observed = given.observed
    state, now_s = observed.state, observed.now_s
    if not state.connected:
        return _silent(flight, observed)
    if flight.change is not None:
        flight = settle_change(flight, flight.change, observed)
    flight = flight.with_run(observed, link_security=weaker(flight.run.link_security, state.link_security))
    clock = flight.clock
    if state.boot_time_s is not None and state.position_age_s is not None:
        clock = clock.seen(now_s - state.position_age_s, state.boot_time_s)
    flight = replace(flight, clock=clock, link=flight.link.connected(now_s))
    flight = _compare_mission(flight, observed)
    if flight.link.rebooted:
        flight = _left_unseen(flight, observed, was_away=flight.link.was_away)
        return _end(flight, observed, RunState.FAILED, Reason.of(ReasonCode.REBOOTED))
    flight = changed(
        flight,
        mode=flight.mode.seen(state, now_s),
        was_airborne=flight.was_airborne or is_airborne(state),
        was_armed=flight.was_armed or bool(state.armed) or flight.link.heard_s(now_s) > SLOWEST_HEARTBEAT_S,
    )
    flight = flight.having_taken_off(observed).having_landed(state).having_driven(state)
    flight = _time_items(_observe_drops(follow_mission(flight, observed), observed), observed)
    return _follow_target(_follow_phase(flight, observed), observed)


def _compare_mission(flight: Flight, observed: Observation) -> Flight:
    """After another client has replaced the mission it is not told which item was executed last."""
    other = flight.other_mission.seen(is_other=flight.names_other(observed.state), now_s=observed.now_s)
    if other.is_settled(observed.now_s):
        flight = _left_unseen(flight, observed, was_away=flight.link.was_away)
    return changed(flight, other_mission=other, lost_mission=flight.lost_mission.seen(observed.state, observed.now_s))


def _silent(flight: Flight, observed: Observation) -> Flight:
    """What does not wait for the link."""
    flight = replace(flight, link=flight.link.silent(was_airborne=flight.was_airborne))
    snapshot = flight.snapshot(observed)
    for release in flight.segment.supervised:
        if not release.is_over:
            flight = flight.with_release(observed, release.silent(snapshot))
    silent_s = observed.now_s - flight.link.last_heard_s
    if silent_s > flight.lost_after_s:
        flight = _left_unseen(flight, observed, was_away=True)
        return _end(flight, observed, RunState.LOST, Reason.of(ReasonCode.NOT_HEARD, silent_s=silent_s))
    return flight


def _fact_received(flight: Flight, given: inputs.FactReceived) -> Flight:
    observed, fact = given.observed, given.fact
    match fact:
        case ItemReached():
            return flight if flight.is_changing else item_reached(flight, observed, fact)  # of which mission is unknown
        case MissionCurrent():
            ours = fact.mission_id == flight.run.mission_id and not flight.is_changing
            return item_shown(flight, observed, fact.seq, fact.mode) if ours else flight
        case Rebooted():
            return replace(flight, link=replace(flight.link, rebooted=True))
        case ClockRateSet():
            return replace(flight, clock=flight.clock.set_to(fact.rate))
        case StatusText():
            return replace(flight, lost_mission=flight.lost_mission.told(fact, observed.now_s))


# Before the flight, and after a restart of the service.


def _state_reached(flight: Flight, given: inputs.StateReached) -> Flight:
    """A vehicle that waited for its start for long is not lost because nobody observed it meanwhile."""
    if given.observed.state.connected:
        flight = replace(flight, link=replace(flight.link, last_heard_s=given.observed.now_s))
    return flight.in_state(given.observed, given.state, given.reason)


def _upload_progressed(flight: Flight, given: inputs.UploadProgressed) -> Flight:
    run = flight.run.model_copy(update={"upload_percent": given.progress.percent})
    return replace(flight, run=run).recording(given.progress)  # this event is sufficient: no run.changed


def _upload_verified(flight: Flight, given: inputs.UploadVerified) -> Flight:
    flight = flight.with_run(given.observed, mission_id=given.mission_id, upload_percent=100.0)
    return flight.in_state(given.observed, RunState.UPLOADED, given.reason)


def _recovered(flight: Flight, given: inputs.Recovered) -> Flight:
    """Continue where an earlier process stopped observing. PX4 repeats reached items for ten seconds."""
    observed = given.observed
    if given.arrived is not None:
        flight = flight.recording(given.arrived).recording(RunChanged(flight.run))
    else:
        flight = flight.with_run(observed, changing=None)
    is_started = flight.run.state is not RunState.STARTING and not flight.is_left_at_start
    was_airborne = is_started or is_airborne(observed.state)
    if flight.run.state is RunState.STARTING:
        flight = flight.in_state(observed, RunState.FLYING, Reason.of(ReasonCode.RESTART_DURING_START_ARMED))
    if not given.in_flight:
        return flight
    reached = flight.run.reached_seq
    passed_to = reached if given.flown and reached is not None else -1
    progress = replace(flight.progress, flown=given.flown, passed_to=passed_to)
    flight = replace(flight, progress=progress, item_clock=flight.item_clock.recovered(given, flight.segment.releases))
    if given.current is not None and flight.is_of_mission(given.current, observed.state.mode):
        flight = flight.with_progress(observed, flight.progress.now_current(given.current))
        flight = flight.with_run(observed, item_id=flight.progress.item_id)
    return replace(flight, was_airborne=was_airborne, was_armed=True, link=replace(flight.link, was_away=True))


# Commands of users and of the plan.


def _command_requested(flight: Flight, given: inputs.CommandRequested) -> Flight:
    cancelled = failsafe_of(flight.run.reason) if given.action is RunAction.PAUSE else None
    flight = replace(flight, offboard=flight.offboard.commanded(), cancelled_failsafe=cancelled)
    if given.action is RunAction.LAND and flight.mission_done and given.observed.state.landed is LandedState.ON_GROUND:
        return flight  # it stands where the mission ends
    return flight.with_run(given.observed, commanded=given.action, rally=given.rally)


def _contingency_begun(flight: Flight, given: inputs.ContingencyBegun) -> Flight:
    return flight.with_run(given.observed, commanded=given.action)


def _command_failed(flight: Flight, given: inputs.CommandFailed) -> Flight:
    if flight.run.commanded is not given.action:
        return flight
    return flight.with_run(given.observed, commanded=given.before, rally=given.rally)


def _command_pending(flight: Flight, given: inputs.CommandPending) -> Flight:
    return replace(flight, command=replace(flight.command, pending=given.action))


def _set_current_pending(flight: Flight, given: inputs.SetCurrentPending) -> Flight:
    return replace(flight, command=replace(flight.command, moving_on=flight.command.moving_on + given.count))


# Drops.


def _divert_begun(flight: Flight, given: inputs.DivertBegun) -> Flight:
    """From now on the drop at the alternate is observed too."""
    flight = replace(flight, segment=flight.segment.diverted(given.plan_item_id))
    alternate = flight.segment.alternates[given.plan_item_id]
    return flight.with_run(given.observed, drops=(*flight.run.drops, alternate.record))


def _answer(
    flight: Flight,
    given: inputs.ReleaseAcknowledged | inputs.ReleaseUnanswered | inputs.ReleaseNotSent,
    step_release: Callable[[SupervisedRelease], ReleaseStep],
) -> Flight:
    """Pass the answer to a release to its drop; ignore an answer for a plan that was changed since."""
    release = flight.find(given.plan_item_id, given.segment)
    if not isinstance(release, SupervisedRelease):
        return flight
    after, commands = step_release(release)
    return flight.with_release(given.observed, after).commanding(*commands)


def _release_acknowledged(flight: Flight, given: inputs.ReleaseAcknowledged) -> Flight:
    snapshot = flight.snapshot(given.observed)
    return _answer(flight, given, lambda drop: drop.acked(given.attempt, given.ack, snapshot))


def _release_unanswered(flight: Flight, given: inputs.ReleaseUnanswered) -> Flight:
    snapshot = flight.snapshot(given.observed)
    return _answer(flight, given, lambda drop: drop.timed_out(given.attempt, snapshot))


def _release_not_sent(flight: Flight, given: inputs.ReleaseNotSent) -> Flight:
    snapshot = flight.snapshot(given.observed)
    return _answer(flight, given, lambda drop: drop.withheld(given.attempt, snapshot))


def _gripper_used(flight: Flight, given: inputs.GripperUsed) -> Flight:
    """A parcel that was kept counts too: a changed plan may try it again."""
    for release in flight.segment.releases:
        if not release.is_over or release.record.outcome is DropOutcome.KEPT:
            flight = flight.with_release(given.observed, release.gripper_used(GripperUse.TASK, flight.progress))
    return flight


def _consent_answered(flight: Flight, given: inputs.ConsentAnswered) -> Flight:
    release = flight.segment.find(given.plan_item_id)
    if not isinstance(release, SupervisedRelease):
        return flight
    after = release.answered(given.answer, given.actor, flight.snapshot(given.observed))
    return flight if after is None else flight.with_release(given.observed, after)


def _observe_drops(flight: Flight, observed: Observation) -> Flight:
    snapshot = flight.snapshot(observed)
    for release in flight.segment.releases:
        if not release.is_over:
            after, commands = release.observe(snapshot, flight.progress)
            flight = flight.with_release(observed, after).commanding(*commands)
    return _seen_near(_passed_unseen(flight, observed), observed)


def _passed_unseen(flight: Flight, observed: Observation) -> Flight:
    """A supervised drop that the mission passed in a loss of the link, with nothing but its return left: it is not
    waited for until the end. In Mission mode the drop itself sees that it was passed, and the plan decides.
    """
    returns = observed.state.mode is FlightMode.RETURN and flight.is_in_final_return
    if flight.link.is_just_back or not (flight.mission_done or returns) or flight.run.commanded not in STAYS_ON_MISSION:
        return flight
    for release in flight.segment.supervised:
        if release.is_passed(flight.progress):
            passed = release.ended(Reason.of(ReasonCode.DROP_HOLD_NOT_SEEN), observed.now_s)
            flight = flight.with_release(observed, passed)
    return flight


def _seen_near(flight: Flight, observed: Observation) -> Flight:
    """What the vehicle reported since the last observation is evidence of the nearest drop."""
    now = observed.state
    before, flight = flight.last_state, replace(flight, last_state=now)
    away_m = [(away, one) for one in flight.segment.releases if (away := offset_m(now, one.compiled)) is not None]
    if before is None or not away_m:
        return flight
    nearest = min(away_m, key=itemgetter(0))[1]
    record = nearest.record.having_seen(before, now)
    return flight if record is nearest.record else flight.with_release(observed, replace(nearest, record=record))


# Moving targets.


def _follow_target(flight: Flight, observed: Observation) -> Flight:
    if flight.run.is_over or flight.names_other(observed.state):
        return flight
    rate, offset = flight.clock.sure_rate, flight.default_max_offset_m
    target, effect = flight.target.follow(flight.run, flight.segment, observed, rate, offset)
    return _with_target(flight, target, effect)


def _target_not_followed(flight: Flight, given: inputs.TargetNotFollowed) -> Flight:
    follower = follower_at(flight.segment.plan, flight.run.item_id)
    if follower is None or follower.drop.id != given.plan_item_id:
        return flight
    return _with_target(flight, *flight.target.not_followed(follower, given.observed, given.reason))


def _with_target(
    flight: Flight, target: TargetTracker, effect: inputs.MoveWaypoint | RunTargetNotFollowed | None
) -> Flight:
    flight = flight if target is flight.target else replace(flight, target=target)
    if isinstance(effect, inputs.MoveWaypoint):
        return flight.commanding(effect)
    return flight if effect is None else flight.recording(effect)


# The items' times, and the phase.


def _time_items(flight: Flight, observed: Observation) -> Flight:
    is_off = observed.state.mode is not FlightMode.MISSION or flight.names_other(observed.state)
    paused = flight.run.state is RunState.PAUSED and is_off
    item_clock, ended = flight.item_clock.observe(
        flight.snapshot(observed),
        flight.progress,
        flight.segment.releases,
        was_airborne=flight.was_airborne,
        is_paused=paused,
        is_just_back=flight.link.is_just_back,
    )
    flight = replace(flight, item_clock=item_clock)
    for item in ended:
        flight = flight.recording(item)
    return flight


def _follow_phase(flight: Flight, observed: Observation) -> Flight:
    flight = changed(flight, offboard=flight.offboard.seen(observed.state.mode))
    state = flight.run.state
    if flight.was_armed and is_landing_unsure(observed.state):
        return changed(flight, landed_at_s=None)
    facts = _phase_facts(flight, observed.state, observed.now_s)
    phase, reason = phase_of(facts)
    if phase is not RunState.LANDED:
        flight = changed(flight, landed_at_s=None)
        if state is RunState.LANDED and facts.has_driven_to_end:  # somebody took it before it was disarmed
            return _over(flight, observed, flight.run.reason)
        may_follow = phase is state or (phase in NEXT[state] and not (state is RunState.LANDED and flight.is_down))
        return flight.in_state(observed, phase, reason) if may_follow else flight
    if phase not in NEXT[state] and state is not RunState.LANDED:  # recovered during its start
        return _end(flight, observed, RunState.FAILED, reason or Reason.of(ReasonCode.NOT_TAKEN_OFF))
    if (landed_at_s := flight.landed_at_s) is None:
        durations = observed.state.durations
        landed_at_s = observed.now_s - (0.0 if durations is None else durations.disarmed_s)
        flight = replace(flight, landed_at_s=landed_at_s).in_state(observed, RunState.LANDED, reason)
    landed_s = observed.now_s - landed_at_s
    if _waits_for_reports(flight, landed_s) or (facts.is_left_armed and landed_s < DISARMED_WITHIN_S):
        return flight
    return _over(flight, observed, reason)


def _over(flight: Flight, observed: Observation, reason: Reason | None) -> Flight:
    last, why = final_state(
        mission_done=flight.mission_done,
        commanded=flight.run.commanded,
        reason=reason,
        returns_at_end=flight.segment.mission.ends_with_return,
        lands_at_end=flight.segment.mission.ends_with_landing,
        elsewhere=flight.why_elsewhere,
        fallen=flight.why_fallen(observed.state),
        landed_for=None if flight.touchdown is None else flight.touchdown.reason,
    )
    return _end(flight, observed, last, why)


def _phase_facts(flight: Flight, state: VehicleState, now_s: float) -> PhaseFacts:
    run = flight.run
    return PhaseFacts(
        state=state,
        vehicle_type=flight.segment.plan.vehicle_type,
        at_drop=any(release.is_active for release in flight.segment.releases),
        mission_done=flight.mission_done,
        was_airborne=flight.was_airborne,
        commanded=run.commanded,
        pending=flight.command.pending,
        is_unobeyed=run.commanded in OBEYED_IN and flight.command.obeyed != run.commanded,
        was_armed=flight.was_armed,
        after_offboard=flight.offboard.had_it,
        at_last_item=flight.is_at_last_item(state),
        mode_is_settled=flight.mode.is_settled(now_s),
        by_failsafe=flight.mode.by_failsafe,
        was_returning=run.state is RunState.RETURNING,
        was_landed=run.state is RunState.LANDED,
        paused_for=run.reason if run.state is RunState.PAUSED else None,
        is_down=flight.is_down,
        is_on_mission=flight.is_on_mission,
        returns_at_end=flight.segment.mission.ends_with_return,
        rally_point=None if run.rally is None else run.rally.index + 1,
        is_left_at_start=flight.is_left_at_start,
        carries_other=flight.other_mission.is_settled(now_s),
        lost_mission_for=flight.lost_mission.reason,
        home_moved=flight.home.reason,
        cancelled_failsafe=flight.cancelled_failsafe,
        asks_consent_to=next((r.record.plan_item_id for r in flight.segment.supervised if r.is_asking), ""),
    )


def awaits_disarming(flight: Flight, observed: Observation) -> bool:
    """Whether the run has ended but for a vehicle that is left armed, and is Waydrop's to disarm: see PhaseFacts."""
    facts = _phase_facts(flight, observed.state, observed.now_s)
    return flight.run.state is RunState.LANDED and observed.state.connected and facts.is_left_armed


def _waits_for_reports(flight: Flight, landed_s: float) -> bool:
    """The heartbeat that says disarmed may overtake the report that the last item was reached."""
    on_mission = flight.run.commanded in STAYS_ON_MISSION
    if not flight.mission_done and on_mission and landed_s < LAST_REPORTS_S:
        return True
    return landed_s < UNFINISHED_DROPS_S and any(release.awaits_answer for release in flight.segment.supervised)


# The end.


def _run_ended(flight: Flight, given: inputs.RunEnded) -> Flight:
    return _end(flight, given.observed, given.state, given.reason)


def _left_unseen(flight: Flight, observed: Observation, *, was_away: bool) -> Flight:
    """A drop that is a mission item needs no link: the vehicle may have released the parcel unobserved."""
    if flight.run.state in NOT_STARTED:
        return flight
    for release in flight.segment.releases:
        if isinstance(release, EmbeddedRelease) and not release.is_over:
            flight = flight.with_release(observed, release.left_unseen(was_away=was_away))
    return flight


def _end(flight: Flight, observed: Observation, state: RunState, reason: Reason | None) -> Flight:
    """The run's last state: every drop that is still open ends with it."""
    for release in flight.segment.releases:
        if not release.is_over:
            left_open = reason_left_open(state, reason)
            flight = flight.with_release(observed, release.ended(left_open, observed.now_s), at_end=True)
    return flight.ended(observed, state, reason)


_STEPS: Final[dict[type[FlightInput], Callable[[Flight, Any], Flight]]] = {
    inputs.Observed: _observed,
    inputs.FactReceived: _fact_received,
    inputs.StateReached: _state_reached,
    inputs.UploadProgressed: _upload_progressed,
    inputs.UploadVerified: _upload_verified,
    inputs.Recovered: _recovered,
    inputs.CommandRequested: _command_requested,
    inputs.ContingencyBegun: _contingency_begun,
    inputs.CommandFailed: _command_failed,
    inputs.CommandPending: _command_pending,
    inputs.SetCurrentPending: _set_current_pending,
    inputs.DivertBegun: _divert_begun,
    inputs.ReleaseAcknowledged: _release_acknowledged,
    inputs.ReleaseUnanswered: _release_unanswered,
    inputs.ReleaseNotSent: _release_not_sent,
    inputs.GripperUsed: _gripper_used,
    inputs.ConsentAnswered: _consent_answered,
    inputs.TargetNotFollowed: _target_not_followed,
    inputs.ChangeBegun: change_begun,
    inputs.ChangeWithdrawn: change_withdrawn,
    inputs.ChangeArrived: change_arrived,
    inputs.ChangeTransferEnded: change_transfer_ended,
    inputs.ChangeRefused: change_refused,
    inputs.RunEnded: _run_ended,
}
HANDLED: Final = frozenset(_STEPS)
"""The inputs that have a step; a test checks that these are all."""
