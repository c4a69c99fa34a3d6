"""The state machine of a supervised drop: waiting -> holding (-> asking) -> releasing -> done."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from app.domain.drop.record import Certainty, DropOutcome, DropPhase
from app.domain.drop.supervised_inputs import (
    GRIPPER_CLOSED_US,
    GRIPPER_OPEN_US,
    OUTPUT_FRESH_S,
    ConsentGiven,
    ConsentUnanswered,
    Divert,
    DropEffect,
    DropInput,
    DropObservation,
    Finish,
    ReleaseAck,
    ReleaseTimedOut,
    ReleaseWithheld,
    Resume,
    RunEnding,
    SendRelease,
    output_of,
)
from app.domain.drop.supervised_state import DropMachine, is_holding, is_passed, reason_against
from app.domain.model import changed
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode

Effects = tuple[DropEffect, ...]


def conclude(drop: DropMachine, seen: DropObservation | None, reason: Reason) -> tuple[DropMachine, Effects]:
    """Close a drop that was not accepted: with what was commanded, if anything was, and what the output shows."""
    if drop.opened:
        outcome, certainty = DropOutcome.RELEASED, Certainty.INFERRED
        reason = Reason.of(ReasonCode.DROP_BUT_RELEASED, reason)
    elif drop.own_output_of(seen) == GRIPPER_CLOSED_US and seen is not None and seen.connected:
        outcome, certainty = DropOutcome.KEPT, Certainty.INFERRED
        reason = Reason.of(ReasonCode.DROP_STILL_AT_GRAB, reason)
    elif drop.unsure:
        outcome, certainty = DropOutcome.UNKNOWN, Certainty.NONE
    else:
        outcome, certainty = DropOutcome.KEPT, _certainty_kept(drop)
    return finish_and_resume(drop, seen, outcome, certainty, reason)


def ended(drop: DropMachine, given: RunEnding) -> tuple[DropMachine, Effects]:
    """Finish a drop at the end of its run."""
    if not drop.attempts:
        return finish(drop, DropOutcome.KEPT, Certainty.INFERRED, given.reason)
    if drop.accepted_at_s is not None and acks_prove_nothing(drop) and not drop.opened:
        reason = Reason.of(ReasonCode.DROP_ACKNOWLEDGED_ON_OPEN_LINK)
        return finish(drop, DropOutcome.UNKNOWN, Certainty.NONE, reason)
    if drop.accepted_at_s is not None:
        reason = Reason.of(ReasonCode.DROP_ACKNOWLEDGED_THEN, given.reason)
        return finish(drop, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, reason)
    if drop.opened:
        reason = Reason.of(ReasonCode.DROP_ACK_MISSING_RELEASED_THEN, given.reason)
        return finish(drop, DropOutcome.RELEASED, Certainty.INFERRED, reason)
    if drop.in_flight is not None or drop.unsure:
        return finish(drop, DropOutcome.UNKNOWN, Certainty.NONE, given.reason)
    return finish(drop, DropOutcome.KEPT, _certainty_kept(drop), given.reason)


def _certainty_kept(drop: DropMachine) -> Certainty:
    """A rejection is an acknowledgement. A release that was never sent has none."""
    return Certainty.INFERRED if drop.withheld == drop.attempts else Certainty.ACKNOWLEDGED


def finish(
    drop: DropMachine, outcome: DropOutcome, certainty: Certainty, reason: Reason
) -> tuple[DropMachine, tuple[Finish]]:
    """End the drop. The mission continues without a command."""
    if drop.used_by is not None:
        outcome, certainty, reason = DropOutcome.UNKNOWN, Certainty.NONE, drop.used_by.doubt(reason)
    consent = drop.consent.withdrawn(at_end=True)
    return replace(drop, phase=DropPhase.DONE, in_flight=None, consent=consent), (Finish(outcome, certainty, reason),)


def finish_and_resume(
    drop: DropMachine, seen: DropObservation | None, outcome: DropOutcome, certainty: Certainty, reason: Reason
) -> tuple[DropMachine, Effects]:
    """Finish. Advance the mission only if it certainly waits at this drop long enough for that.

    A mode chosen by others is never overridden, and an item that the mission has already passed is never revisited. Go
    to the alternate if there is one and the parcel is certainly on board: every release that was sent was rejected.
    """
    drop, finished = finish(drop, outcome, certainty, reason)
    if seen is None or not still_waits(drop, seen, drop.terms.resume_s):
        return drop, finished
    if drop.terms.alternate_seq is not None and finished[0].outcome is DropOutcome.KEPT and not drop.unsure:
        return drop, (*finished, Divert(drop.terms.alternate_seq))
    return drop, (*finished, Resume(drop.terms.resume_seq))


def acks_prove_nothing(drop: DropMachine) -> bool:
    """Whether the vehicle's answer could have been sent by anybody."""
    return drop.last_seen is not None and drop.last_seen.link_is_open


def still_waits(drop: DropMachine, seen: DropObservation, needed_s: float) -> bool:
    """Whether the vehicle is observed at this drop and will remain there for this time."""
    waits = seen.connected and is_holding(seen, drop.terms)
    return waits and drop.hold.waits_longer_than(needed_s, seen, drop.terms)


_REFUSALS: Final = frozenset({MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED})
_AT_HOLD: Final = frozenset({DropPhase.HOLDING, DropPhase.ASKING})


def step(drop: DropMachine, given: DropInput) -> tuple[DropMachine, Effects]:
    """Return the next state and the effects. A finished drop never changes."""
    if drop.is_over:
        return drop, ()
    match given:
        case DropObservation():
            return _observed(drop, given)
        case ReleaseAck():
            return _acked(drop, given)
        case ReleaseTimedOut():
            if given.attempt != drop.in_flight:
                return drop, ()
            return replace(drop, in_flight=None, unsure=True, retry_at_s=given.now_s), ()
        case ReleaseWithheld():
            if given.attempt != drop.in_flight:
                return drop, ()
            return replace(drop, in_flight=None, withheld=drop.withheld + 1), ()
        case ConsentGiven():
            consent = drop.consent.answered(given.question, grant=given.grant, now_s=given.now_s)
            return replace(drop, consent=consent), ()
        case ConsentUnanswered():
            return replace(drop, consent=drop.consent.at(given.now_s)), ()
        case RunEnding():
            return ended(drop, given)


def _observed(drop: DropMachine, seen: DropObservation) -> tuple[DropMachine, Effects]:
    approached = drop.approached or (
        seen.mode is FlightMode.MISSION
        and seen.mission_seq is not None
        and seen.mission_seq <= max(drop.terms.hold_seqs)
    )
    if _was_away(drop.last_seen, seen):
        drop = replace(drop, calm_since_s=None, lost_sight=drop.lost_sight or drop.attempts > 0)
    opened = drop.opened or (drop.attempts > 0 and drop.own_output_of(seen) == GRIPPER_OPEN_US)
    if drop.last_seen is None and drop.attempts:  # recovered: a release may have been sent moments ago
        accepted_at_s = None if drop.accepted_at_s is None else seen.now_s  # the output has its time anew
        drop = replace(drop, settles_at_s=seen.now_s + drop.terms.output_wait_s, accepted_at_s=accepted_at_s)
    hold, drop = drop.hold.observed(seen, drop.terms), drop.watched(seen)
    drop = replace(drop, hold=hold, approached=approached, opened=opened, last_seen=seen)
    drop = _with_consent(_with_calm(drop, seen), seen)
    if drop.accepted_at_s is not None:
        return _watch_output(drop, seen, drop.accepted_at_s)
    if drop.in_flight is not None:
        return drop, ()
    if drop.attempts:
        return _after_attempt(drop, seen)
    return _before_attempt(drop, seen)


def _was_away(before: DropObservation | None, now: DropObservation) -> bool:
    """Whether the vehicle was not observed for a while until now."""
    return before is None or not before.connected or now.now_s - before.now_s > OUTPUT_FRESH_S


def _with_calm(drop: DropMachine, seen: DropObservation) -> DropMachine:
    """Follow since when the vehicle stands still at the drop, and whether it was out of Mission mode there."""
    if seen.mode is not FlightMode.MISSION:
        return changed(drop, calm_since_s=None, was_away=drop.was_away or drop.phase in _AT_HOLD)
    is_fresh = seen.position_age_s is not None and seen.position_age_s <= drop.terms.max_position_age_s
    is_slow = (seen.ground_speed_m_s or 0.0) <= drop.terms.max_ground_speed_m_s
    if not (is_fresh and is_slow and is_holding(seen, drop.terms)):
        return changed(drop, calm_since_s=None)
    return drop if drop.calm_since_s is not None else replace(drop, calm_since_s=seen.now_s)


def _with_consent(drop: DropMachine, seen: DropObservation) -> DropMachine:
    """Follow what became of the question; it is asked in `_ask` alone."""
    consent = drop.consent.observed(seen, drop.terms)
    phase = DropPhase.HOLDING if drop.phase is DropPhase.ASKING and consent.must_ask else drop.phase
    return changed(drop, consent=consent, phase=phase)


def _before_attempt(drop: DropMachine, seen: DropObservation) -> tuple[DropMachine, Effects]:
    if seen.connected and drop.approached and is_passed(seen, drop.terms):
        reason = drop.consent.reason_against or Reason.of(ReasonCode.DROP_HOLD_OVER_BEFORE_RELEASE)
        if drop.phase is DropPhase.WAITING:
            reason = Reason.of(ReasonCode.DROP_HOLD_NOT_SEEN)
        return finish(drop, DropOutcome.KEPT, Certainty.INFERRED, reason)
    if seen.connected and drop.phase is DropPhase.WAITING and is_holding(seen, drop.terms):
        drop = replace(drop, phase=DropPhase.HOLDING)
    if drop.phase not in _AT_HOLD:
        return drop, ()
    if output_of(seen) == GRIPPER_OPEN_US:
        reason = Reason.of(ReasonCode.DROP_OPEN_BEFORE_COMMAND)
        return finish_and_resume(drop, seen, DropOutcome.UNKNOWN, Certainty.NONE, reason)
    if against := drop.consent.reason_against:
        return (
            conclude(drop, seen, against) if seen.connected else (drop, ())
        )  # then what the plan specifies for a failed drop can be sent
    if _is_hopeless(drop, seen):
        reason = _reason_of_end(reason_against(seen, drop.terms, drop.hold))
        return finish_and_resume(drop, seen, DropOutcome.KEPT, Certainty.INFERRED, reason)
    return _try_release(drop, seen)


def _is_hopeless(drop: DropMachine, seen: DropObservation) -> bool:
    """Whether no later observation of this hold can allow a release: it has ended, or its start was not observed."""
    return is_holding(seen, drop.terms) and drop.hold.left_s(seen, drop.terms) <= drop.terms.release_latency_s


_ON_THE_WAY: Final = frozenset({ReasonCode.TOO_FAR, ReasonCode.TOO_FAST})


def _reason_of_end(against: Reason | None) -> Reason:
    """A vehicle that is still on its way at the end of its hold was stopped by the hold, not by its distance."""
    if against is not None and against.code in _ON_THE_WAY:
        return Reason.of(ReasonCode.DROP_HOLD_OVER_AS, against)
    return against or Reason.of(ReasonCode.DROP_HOLD_OVER)


def _try_release(drop: DropMachine, seen: DropObservation) -> tuple[DropMachine, Effects]:
    needed_s = drop.terms.reentry_calm_s if drop.was_away else drop.terms.calm_s
    calm = drop.calm_since_s is not None and seen.now_s - drop.calm_since_s >= needed_s
    if not calm or seen.now_s < drop.retry_at_s or reason_against(seen, drop.terms, drop.hold) is not None:
        return drop, ()
    if not drop.consent.is_open:
        return _ask(drop, seen)
    attempt = drop.attempts + 1
    drop = replace(drop, phase=DropPhase.RELEASING, attempts=attempt, in_flight=attempt)
    return drop, (SendRelease(attempt),)


def _ask(drop: DropMachine, seen: DropObservation) -> tuple[DropMachine, Effects]:
    """Only an operator's consent is missing: it is requested once per hold."""
    if not drop.consent.must_ask:
        return drop, ()
    asked = drop.consent.asked(seen, drop.terms, drop.hold)
    if asked is None:
        return conclude(drop, seen, Reason.of(ReasonCode.DROP_TOO_LATE_TO_ASK))
    return replace(drop, consent=asked, phase=DropPhase.ASKING), ()


def _acked(drop: DropMachine, given: ReleaseAck) -> tuple[DropMachine, Effects]:
    ack = given.ack
    if given.attempt != drop.in_flight or not ack.is_final:
        return drop, ()
    drop = replace(drop, in_flight=None, retry_at_s=given.now_s + drop.terms.retry_pause_s)
    if ack.result is MavResult.ACCEPTED:
        if output_of(drop.last_seen) is None and acks_prove_nothing(drop):
            return _finish_unproven(drop, drop.last_seen)
        if output_of(drop.last_seen) is None:
            has_gripper = drop.terms.has_gripper
            reason = Reason.of(ReasonCode.DROP_ACKNOWLEDGED_NO_MOVE if has_gripper else ReasonCode.DROP_ACKNOWLEDGED)
            return finish_and_resume(drop, drop.last_seen, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, reason)
        return replace(drop, accepted_at_s=given.now_s), ()
    if ack.result in _REFUSALS and acks_prove_nothing(drop):  # the output decides, once it has had its time
        return replace(drop, unsure=True, settles_at_s=given.now_s + drop.terms.output_wait_s), ()
    if ack.result in _REFUSALS:
        return conclude(drop, drop.last_seen, Reason.of(ReasonCode.DROP_REFUSED, result=ack.word))
    # busy with the same action, or cancelled by the opposite one: whether the gripper moved is unknown
    return replace(drop, unsure=True), ()


def _watch_output(drop: DropMachine, seen: DropObservation, accepted_at_s: float) -> tuple[DropMachine, Effects]:
    """After ACCEPTED (a timer): the output must have moved too, where it can be seen."""
    if drop.opened:
        return finish_and_resume(
            drop, seen, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, Reason.of(ReasonCode.DROP_ACKNOWLEDGED_MOVED)
        )
    if seen.now_s - accepted_at_s < drop.terms.output_wait_s:
        return drop, ()
    unseen = not seen.connected or not _output_is_newer_than(seen, accepted_at_s)
    if unseen and acks_prove_nothing(drop):
        return _finish_unproven(drop, seen)
    if unseen:
        return finish_and_resume(
            drop, seen, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, Reason.of(ReasonCode.DROP_ACKNOWLEDGED_UNSEEN)
        )
    reason = Reason.of(ReasonCode.DROP_ACKNOWLEDGED_NOT_MOVED)
    return finish_and_resume(drop, seen, DropOutcome.UNKNOWN, Certainty.NONE, reason)


def _finish_unproven(drop: DropMachine, seen: DropObservation | None) -> tuple[DropMachine, Effects]:
    """Acknowledged on an open link, without other evidence."""
    return finish_and_resume(
        drop, seen, DropOutcome.UNKNOWN, Certainty.NONE, Reason.of(ReasonCode.DROP_ACKNOWLEDGED_ON_OPEN_LINK)
    )


def _after_attempt(drop: DropMachine, seen: DropObservation) -> tuple[DropMachine, Effects]:
    """No answer is awaited any more, and none settled it: look at the output, try again, or close."""
    if not seen.connected:
        return drop, ()  # facts on board do not change: wait for the link or for the end of the run
    if drop.opened:
        reason = Reason.of(ReasonCode.DROP_ACK_MISSING_RELEASED)
        return finish_and_resume(drop, seen, DropOutcome.RELEASED, Certainty.INFERRED, reason)
    if seen.now_s < drop.settles_at_s:
        return drop, ()
    if against := drop.consent.reason_against:
        return conclude(drop, seen, against)
    if is_passed(seen, drop.terms):
        return conclude(drop, seen, Reason.of(ReasonCode.DROP_HOLD_OVER_BEFORE_ACK))
    if drop.attempts >= drop.terms.max_attempts:
        return conclude(drop, seen, Reason.of(ReasonCode.DROP_ACK_MISSING, attempts=drop.attempts))
    if _is_hopeless(drop, seen):
        return conclude(drop, seen, Reason.of(ReasonCode.DROP_HOLD_OVER_BEFORE_ACK))
    return _try_release(drop, seen)


def _output_is_newer_than(seen: DropObservation, when_s: float) -> bool:
    return seen.gripper_output_age_s is not None and seen.now_s - seen.gripper_output_age_s > when_s
