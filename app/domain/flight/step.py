"""The only function that changes a flight. It has no clock, link or disk: the same inputs give the same flight."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter
from typing import Any, Final

from app.domain.events.run import RunItem, RunMissionChanged
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import (
    AskedFor,
    ChangeArrived,
    ChangeBegun,
    ChangeSent,
    ChangeWithdrawn,
    Commanding,
    ConsentAnswered,
    Diverting,
    DropFailed,
    Ends,
    FlightEffect,
    FlightInput,
    Looked,
    MovingOn,
    NotDone,
    PendingChange,
    ReleaseAnswered,
    ReleaseNotSent,
    ReleaseUnanswered,
    Sight,
    TakenUp,
    Told,
)
from app.domain.flight.leg import changed_to, leg_of
from app.domain.flight.look import offset_m
from app.domain.flight.phase import FlightView, how_it_ended, is_airborne, phase_of, why_open
from app.domain.flight.progress import MissionCompleteDetector, MissionProgress
from app.domain.flight.supervised_release import Heard, SupervisedRelease
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import NEXT, Asked, RunState
from app.domain.vehicle.facts import ClockRateTold, ItemReached, MissionCurrent, Rebooted
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState

UNFINISHED_DROPS_S: Final = 5.0
"""After a landing: maximum time for the answer to a release in progress."""

SLOWEST_HEARTBEAT_S: Final = 3.0
"""After a start: maximum time for a HEARTBEAT that reports arming, if some are lost."""

LAST_REPORTS_S: Final = 2.5
"""After a landing: maximum time for the report that the mission is complete. MISSION_CURRENT is sent at 1 Hz."""

UNASKED: Final = frozenset({None, Asked.PAUSE, Asked.RESUME, Asked.REFUSED})
"""Requests after which the mission still counts as flown to its end."""

OBEYED_IN: Final[dict[Asked | None, FlightMode]] = {
    Asked.PAUSE: FlightMode.HOLD,
    Asked.REFUSED: FlightMode.HOLD,
    Asked.RETURN: FlightMode.RETURN,
    Asked.CONTINGENCY: FlightMode.RETURN,
    Asked.LAND: FlightMode.LAND,
}
"""The mode that fulfils a request."""


def step(flight: Flight, heard: FlightInput) -> tuple[Flight, tuple[FlightEffect, ...]]:
    """Return the flight after an input, and the effects in order. A finished flight never changes."""
    if flight.run.is_over:
        return flight, ()
    after = _STEPS[type(heard)](flight, heard)
    return replace(after, effects=()), after.effects


def _looked(flight: Flight, heard: Looked) -> Flight:
    sight = heard.sight
    state, now_s = sight.state, sight.now_s
    if state.connected and state.boot_time_s is not None and state.position_age_s is not None:
        flight = replace(flight, rate=flight.rate.seen(now_s - state.position_age_s, state.boot_time_s))
    if not state.connected:
        return _silent(flight, sight)
    if flight.change is not None:
        flight = _settle_change(flight, flight.change, sight)
    since_s = flight.connected_since_s
    if since_s is None:
        since_s = -math.inf if flight.first_look_s is None else now_s
    flight = replace(flight, connected_since_s=since_s, connected_at_s=now_s)
    if flight.rebooted:
        return _end(flight, sight, RunState.FAILED, Reason.of(ReasonCode.REBOOTED))
    first_look_s = now_s if flight.first_look_s is None else flight.first_look_s
    flight = replace(
        flight,
        mode=flight.mode.seen(state, now_s),
        first_look_s=first_look_s,
        was_airborne=flight.was_airborne or is_airborne(state),
        was_armed=flight.was_armed or bool(state.armed) or now_s - first_look_s > SLOWEST_HEARTBEAT_S,
    )
    flight = _time_items(_look_at_drops(_follow_mission(flight, sight), sight), sight)
    return _follow_phase(flight, sight)


def _silent(flight: Flight, sight: Sight) -> Flight:
    """Effects that do not depend on the link. The vehicle may have flown to its end unobserved."""
    flight = replace(flight, was_away=flight.was_airborne)
    look = flight.look(sight)
    for release in flight.leg.supervised:
        if not release.is_over:
            flight = flight.with_release(sight, release.silent(look))
    silent_s = sight.now_s - flight.connected_at_s
    if silent_s > flight.lost_after_s:
        flight = _end(flight, sight, RunState.LOST, Reason.of(ReasonCode.NOT_HEARD, silent_s=silent_s))
    return replace(flight, connected_since_s=None)


def _told(flight: Flight, heard: Told) -> Flight:
    sight, fact = heard.sight, heard.fact
    match fact:
        case ItemReached():
            return flight if flight.is_changing else _reached(flight, sight, fact)  # it is unknown of which mission
        case MissionCurrent():
            ours = fact.mission_id == flight.run.mission_id and not flight.is_changing
            return _shown(flight, sight, fact.seq, fact.mode) if ours else flight
        case Rebooted():
            return replace(flight, rebooted=True)
        case ClockRateTold():
            return replace(flight, rate=flight.rate.told(fact.rate))


def _reached(flight: Flight, sight: Sight, fact: ItemReached) -> Flight:
    mode = fact.mode or sight.state.mode
    if mode is not FlightMode.MISSION and fact.seq != flight.progress.last_seq:
        return flight
    if flight.leg.mission.is_return(fact.seq):
        flight = flight.flying_to(sight, flight.progress.begun(fact.seq))
    else:
        item_id = flight.progress.plan_item_of.get(fact.seq)
        flight = flight.noted(RunItem(seq=fact.seq, phase="reached", item_id=item_id))
    return flight.advanced(sight, flight.progress.reached(fact.seq))


def _shown(flight: Flight, sight: Sight, seq: int, mode: FlightMode | None) -> Flight:
    """MISSION_CURRENT. A return is recognized by its mode, which may arrive before its item."""
    returns = mode is FlightMode.RETURN and flight.was_airborne and flight.leg.mission.is_return(seq)
    if mode is FlightMode.MISSION or returns:
        return flight.flying_to(sight, flight.progress.now_current(seq))
    return flight


def _taken_up(flight: Flight, heard: TakenUp) -> Flight:
    """Continue where an earlier process stopped. PX4 repeats REACHED for ten seconds."""
    reached = flight.run.reached_seq
    passed_to = reached if heard.flown and reached is not None else -1
    progress = replace(flight.progress, flown=heard.flown, passed_to=passed_to)
    flight = replace(flight, progress=progress, items=flight.items.taken_up(heard.flown))
    if heard.current is not None:
        flight = flight.advanced(heard.sight, flight.progress.now_current(heard.current))
        flight = flight.changed(heard.sight, item_id=flight.progress.item_id)
    return replace(flight, was_airborne=True, was_armed=True, was_away=True)


def _asked_for(flight: Flight, heard: AskedFor) -> Flight:
    flight = replace(flight, offboard=flight.offboard.asked())
    return flight.changed(heard.sight, asked=heard.asked, rally=heard.rally)


def _drop_failed(flight: Flight, heard: DropFailed) -> Flight:
    return flight.changed(heard.sight, asked=heard.asked)


def _not_done(flight: Flight, heard: NotDone) -> Flight:
    if flight.run.asked is not heard.asked:
        return flight
    return flight.changed(heard.sight, asked=heard.before, rally=heard.rally)


def _commanding(flight: Flight, heard: Commanding) -> Flight:
    return replace(flight, command=heard.asked)


def _moving_on(flight: Flight, heard: MovingOn) -> Flight:
    return replace(flight, moving_on=flight.moving_on + heard.count)


def _diverting(flight: Flight, heard: Diverting) -> Flight:
    """From now on the drop at the alternate is observed too."""
    flight = replace(flight, leg=flight.leg.diverted(heard.plan_item_id))
    alternate = flight.leg.alternates[heard.plan_item_id]
    return flight.changed(heard.sight, drops=(*flight.run.drops, alternate.record))


def _answer(
    flight: Flight,
    heard: ReleaseAnswered | ReleaseUnanswered | ReleaseNotSent,
    tell: Callable[[SupervisedRelease], Heard],
) -> Flight:
    """Deliver the answer of a release to its drop, unless the plan was changed since."""
    release = flight.find(heard.plan_item_id, heard.leg)
    if not isinstance(release, SupervisedRelease):
        return flight
    after, orders = tell(release)
    return flight.with_release(heard.sight, after).ordering(orders)


def _answered(flight: Flight, heard: ReleaseAnswered) -> Flight:
    look = flight.look(heard.sight)
    return _answer(flight, heard, lambda drop: drop.acked(heard.attempt, heard.ack, look))


def _unanswered(flight: Flight, heard: ReleaseUnanswered) -> Flight:
    look = flight.look(heard.sight)
    return _answer(flight, heard, lambda drop: drop.timed_out(heard.attempt, look))


def _not_sent(flight: Flight, heard: ReleaseNotSent) -> Flight:
    look = flight.look(heard.sight)
    return _answer(flight, heard, lambda drop: drop.withheld(heard.attempt, look))


def _consent_answered(flight: Flight, heard: ConsentAnswered) -> Flight:
    release = flight.leg.find(heard.plan_item_id)
    if not isinstance(release, SupervisedRelease):
        return flight
    after = release.answered(heard.answer, heard.actor, flight.look(heard.sight))
    return flight if after is None else flight.with_release(heard.sight, after)


def _change_begun(flight: Flight, heard: ChangeBegun) -> Flight:
    return replace(flight, change=heard.change).changed(heard.sight, changing=heard.change.change)


def _change_withdrawn(flight: Flight, heard: ChangeWithdrawn) -> Flight:
    return replace(flight, change=None).changed(heard.sight, changing=None)


def _change_arrived(flight: Flight, heard: ChangeArrived) -> Flight:
    return flight if flight.change is None else _take_change(flight, flight.change, heard.sight)


def _change_sent(flight: Flight, heard: ChangeSent) -> Flight:
    if flight.change is None:
        return flight
    return replace(flight, change=replace(flight.change, ended_s=heard.sight.now_s))


def _ends(flight: Flight, heard: Ends) -> Flight:
    return _end(flight, heard.sight, heard.state, heard.reason)


def _settle_change(flight: Flight, change: PendingChange, sight: Sight) -> Flight:
    """Follow the mission that the vehicle reports as its own."""
    if change.has_arrived(sight.state):
        return _take_change(flight, change, sight)
    since_s = flight.connected_since_s
    if change.is_missing(sight.state, sight.now_s if since_s is None else since_s, sight.now_s):
        return replace(flight, change=replace(change, is_open=False)).changed(sight, changing=None)
    return flight


def _take_change(flight: Flight, change: PendingChange, sight: Sight) -> Flight:
    """The vehicle carries the changed mission, so follow that one from here on."""
    ahead = {drop.plan_item_id for drop in change.mission.drops}
    for release in flight.leg.releases:
        if not release.is_over and (release.is_busy or release.compiled.plan_item_id not in ahead):
            ended = release.ended(Reason.of(ReasonCode.PLAN_CHANGED), sight.now_s)  # the change removed it
            flight = flight.with_record(sight, ended.record)
    skip_to = change.first_seq(flight.leg.plan, flight.progress)
    # recorded before the change of the run, so that events show which plan was flown until then
    flight = flight.noted(RunMissionChanged(change=change.change, timeline=change.timeline))
    flight = flight.changed(sight, **changed_to(flight.run, change.change, change.mission))
    at_s = change.change.at
    leg = leg_of(flight.run, change.plan, change.mission, flight.default_max_offset_m, changed_at=at_s)
    progress = replace(MissionProgress.of(change.mission), flown=flight.progress.flown, passed_to=skip_to - 1)
    return replace(
        flight,
        leg=leg,
        progress=progress,
        skip_to=skip_to,
        items=flight.items.flown_on(change.mission),
        complete=MissionCompleteDetector(),
        mission_done=False,
        change=None,
    )


def _follow_mission(flight: Flight, sight: Sight) -> Flight:
    state, run = sight.state, flight.run
    flew_unseen = flight.progress.is_behind(state, run.mission_id)
    names_ours = state.mission_id == run.mission_id
    if state.mission_seq is not None and (state.mode is FlightMode.MISSION or flew_unseen):
        flight = replace(flight, was_away=flight.was_away and state.mode is not FlightMode.MISSION)
        flight = flight.flying_to(sight, flight.progress.now_current(state.mission_seq))
    elif state.mission_seq is not None and names_ours:
        flight = _shown(flight, sight, state.mission_seq, state.mode)
    progress = flight.progress
    near_end = progress.current == progress.last_seq or progress.is_complete or (flight.was_away and names_ours)
    flight = _settle_asked(replace(flight, complete=flight.complete.seen(state)), sight)
    unasked = flight.run.asked in UNASKED
    if near_end and unasked and flight.complete.says_done(state, last_seq=progress.last_seq):
        flight = flight.advanced(sight, flight.progress.completed())
    return replace(flight, mission_done=True) if flight.progress.is_complete and unasked else flight


def _settle_asked(flight: Flight, sight: Sight) -> Flight:
    """A request explains one change of mode. If the vehicle then continues its mission, others commanded that."""
    asked, state = flight.run.asked, sight.state
    flight = replace(flight, obeyed=asked) if state.mode is OBEYED_IN.get(asked) else flight
    in_air = state.landed is not LandedState.ON_GROUND and flight.mode.is_settled(sight.now_s)
    goes_on = flight.obeyed == asked and in_air  # PX4 may be in Mission mode for a moment while landing
    if asked and state.mode is FlightMode.MISSION and (asked is Asked.RESUME or goes_on):
        flight = flight.changed(sight, asked=None)
    return flight if flight.run.asked else replace(flight, obeyed=None)


def _look_at_drops(flight: Flight, sight: Sight) -> Flight:
    look = flight.look(sight)
    for release in flight.leg.releases:
        if not release.is_over:
            after, orders = release.look(look, flight.progress)
            flight = flight.with_release(sight, after).ordering(orders)
    return _seen_near(flight, sight)


def _seen_near(flight: Flight, sight: Sight) -> Flight:
    """Reports since the last observation are evidence of the nearest drop."""
    now = sight.state
    before, flight = flight.seen, replace(flight, seen=now)
    away_m = [(away, one) for one in flight.leg.releases if (away := offset_m(now, one.compiled)) is not None]
    if before is None or not away_m:
        return flight
    nearest = min(away_m, key=itemgetter(0))[1]
    record = nearest.record.having_seen(before, now)
    return flight if record is nearest.record else flight.with_release(sight, replace(nearest, record=record))


def _time_items(flight: Flight, sight: Sight) -> Flight:
    paused = flight.run.state is RunState.PAUSED and sight.state.mode is not FlightMode.MISSION
    look, drops = flight.look(sight), flight.leg.releases
    airborne = flight.was_airborne
    items, ended = flight.items.look(look, flight.progress, drops, was_airborne=airborne, is_paused=paused)
    flight = replace(flight, items=items)
    for item in ended:
        flight = flight.noted(item)
    return flight


def _follow_phase(flight: Flight, sight: Sight) -> Flight:
    flight = replace(flight, offboard=flight.offboard.seen(sight.state.mode))
    state = flight.run.state
    phase, reason = phase_of(_view(flight, sight.state, sight.now_s))
    if phase is not RunState.LANDED:
        flight = replace(flight, landed_at_s=None)
        return flight.moved(sight, phase, reason) if phase is state or phase in NEXT[state] else flight
    if phase not in NEXT[state] and state is not RunState.LANDED:  # recovered during its start
        return _end(flight, sight, RunState.FAILED, reason or Reason.of(ReasonCode.NOT_TAKEN_OFF))
    landed_at_s = flight.landed_at_s
    if landed_at_s is None:
        landed_at_s = sight.now_s
        flight = replace(flight, landed_at_s=landed_at_s).moved(sight, RunState.LANDED, reason)
    if _waits_for_reports(flight, sight.now_s - landed_at_s):
        return flight
    last, why = how_it_ended(mission_done=flight.mission_done, asked=flight.run.asked, reason=reason)
    return _end(flight, sight, last, why)


def _view(flight: Flight, state: VehicleState, now_s: float) -> FlightView:
    run, progress = flight.run, flight.progress
    return FlightView(
        state=state,
        vehicle_type=flight.leg.plan.vehicle_type,
        at_drop=any(release.is_active for release in flight.leg.releases),
        mission_done=flight.mission_done,
        was_airborne=flight.was_airborne,
        asked=run.asked,
        command=flight.command,
        was_armed=flight.was_armed,
        after_offboard=flight.offboard.had_it,
        at_last_item=progress.current == progress.last_seq,
        mode_is_settled=flight.mode.is_settled(now_s),
        by_failsafe=flight.mode.by_failsafe,
        was_returning=run.state is RunState.RETURNING,
        rally_point=None if run.rally is None else run.rally.index + 1,
        asks_consent_to=next((r.record.plan_item_id for r in flight.leg.supervised if r.is_asking), ""),
    )


def _waits_for_reports(flight: Flight, landed_s: float) -> bool:
    """The HEARTBEAT that reports disarming may overtake the report that the last item was reached."""
    if not flight.mission_done and flight.run.asked in UNASKED and landed_s < LAST_REPORTS_S:
        return True
    return landed_s < UNFINISHED_DROPS_S and any(release.awaits_answer for release in flight.leg.supervised)


def _end(flight: Flight, sight: Sight, state: RunState, reason: Reason | None) -> Flight:
    """Return the final state of the run. Every open drop ends with it."""
    for release in flight.leg.releases:
        if not release.is_over:
            flight = flight.with_release(sight, release.ended(why_open(state, reason), sight.now_s))
    return flight.changed(sight, item_id=None).moved(sight, state, reason)


_STEPS: Final[dict[type[FlightInput], Callable[[Flight, Any], Flight]]] = {
    Looked: _looked,
    Told: _told,
    TakenUp: _taken_up,
    AskedFor: _asked_for,
    DropFailed: _drop_failed,
    NotDone: _not_done,
    Commanding: _commanding,
    MovingOn: _moving_on,
    Diverting: _diverting,
    ReleaseAnswered: _answered,
    ReleaseUnanswered: _unanswered,
    ReleaseNotSent: _not_sent,
    ConsentAnswered: _consent_answered,
    ChangeBegun: _change_begun,
    ChangeWithdrawn: _change_withdrawn,
    ChangeArrived: _change_arrived,
    ChangeSent: _change_sent,
    Ends: _ends,
}
"""The step of each kind of input. A test checks that none is missing."""
