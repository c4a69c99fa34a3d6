"""The supervised drop, step by step: waiting -> holding -> releasing -> done."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.commands import MavResult
from app.domain.drop import Certainty, DropOutcome, DropPhase
from app.domain.supervised.checks import is_holding, is_passed, reason_against
from app.domain.supervised.hold import HoldClock
from app.domain.supervised.inputs import (
    DropEffect,
    DropInput,
    Finish,
    Observation,
    ReleaseAck,
    ReleaseTimedOut,
    ReleaseWithheld,
    Resume,
    RunEnding,
    SendRelease,
)
from app.domain.supervised.terms import GRIPPER_CLOSED_US, GRIPPER_OPEN_US, LATE_SIGN_S, DropTerms
from app.domain.vehicle import FlightMode

_REFUSALS: Final = frozenset({MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED})
Effects = tuple[DropEffect, ...]


@dataclass(frozen=True, slots=True)
class DropMachine:
    """The state of one supervised drop.

    `in_flight` is the attempt whose final ack is awaited. `unsure` says that some attempt had no final answer, so the
    parcel may be gone. `opened`: the output was seen at release after one; a later output (900 when disarmed) takes
    nothing from that. `withheld` counts attempts that were never sent. `approached` is set once the mission was seen
    before or at the hold, so that a stale index from an earlier flight does not count as passed. `accepted_at_s` is
    set while the gripper's output is watched after an ACCEPTED.

    Laws (tests/unit/domain/supervised/test_supervised_laws.py): no release is sent unless every check holds at that
    moment; none after an ACCEPTED; one at a time; one Finish; `kept` never while unsure; `released` never without
    evidence.
    """

    terms: DropTerms
    phase: DropPhase = DropPhase.WAITING
    hold: HoldClock = field(default_factory=HoldClock)
    calm_since_s: float | None = None
    was_away: bool = False
    approached: bool = False
    attempts: int = 0
    withheld: int = 0
    in_flight: int | None = None
    unsure: bool = False
    opened: bool = False
    accepted_at_s: float | None = None
    retry_at_s: float = 0.0
    last_seen: Observation | None = None

    @property
    def is_over(self) -> bool:
        """Whether the drop has its outcome."""
        return self.phase is DropPhase.DONE

    def waiting_since(self, not_begun_at_s: float) -> DropMachine:
        """The machine told, from the journal, that at this time of the vehicle's clock the drop still waited."""
        return replace(self, hold=HoldClock(not_begun_at_s - LATE_SIGN_S))

    def may_send(self, seen: Observation) -> bool:
        """Whether the release that is about to go out is still right at this very moment."""
        return self.in_flight is not None and reason_against(seen, self.terms, self.hold) is None

    def send_before_s(self, seen: Observation) -> float:
        """Our monotonic time after which a release must not leave any more: the hold would not cover its latency."""
        return seen.now_s + self.hold.left_s(seen, self.terms) - self.terms.release_latency_s

    @classmethod
    def taken_up(cls, terms: DropTerms, attempts: int, *, opened: bool = False) -> DropMachine:
        """The machine after a restart of ours, when `attempts` releases were commanded before it and not settled.

        Nothing is sent again: what became of the earlier ones can only be looked at. `opened`: see the class.
        """
        if attempts == 0:
            return cls(terms)
        return cls(
            terms,
            phase=DropPhase.RELEASING,
            approached=True,
            attempts=terms.max_attempts,
            unsure=True,
            opened=opened,
        )


def step(drop: DropMachine, heard: DropInput) -> tuple[DropMachine, Effects]:
    """The next state and what must be done now. After the end nothing changes any more."""
    if drop.is_over:
        return drop, ()
    match heard:
        case Observation():
            return _observed(drop, heard)
        case ReleaseAck():
            return _acked(drop, heard)
        case ReleaseTimedOut():
            if heard.attempt != drop.in_flight:
                return drop, ()
            return replace(drop, in_flight=None, unsure=True, retry_at_s=heard.now_s), ()
        case ReleaseWithheld():
            if heard.attempt != drop.in_flight:
                return drop, ()
            return replace(drop, in_flight=None, withheld=drop.withheld + 1), ()
        case RunEnding():
            return _ended(drop, heard)


def _observed(drop: DropMachine, seen: Observation) -> tuple[DropMachine, Effects]:
    approached = drop.approached or (
        seen.mode is FlightMode.MISSION
        and seen.mission_seq is not None
        and seen.mission_seq <= max(drop.terms.hold_seqs)
    )
    opened = drop.opened or (drop.attempts > 0 and _output(seen) == GRIPPER_OPEN_US)
    hold = drop.hold.observed(seen, drop.terms)
    drop = replace(drop, hold=hold, approached=approached, opened=opened, last_seen=seen)
    drop = _with_calm(drop, seen)
    if drop.accepted_at_s is not None:
        return _watch_output(drop, seen, drop.accepted_at_s)
    if drop.in_flight is not None:
        return drop, ()
    if drop.attempts:
        return _after_attempt(drop, seen)
    return _before_attempt(drop, seen)


def _with_calm(drop: DropMachine, seen: Observation) -> DropMachine:
    """Follow since when the vehicle stands still at the drop, and whether it was out of Mission mode there."""
    if seen.mode is not FlightMode.MISSION:
        return replace(drop, calm_since_s=None, was_away=drop.was_away or drop.phase is DropPhase.HOLDING)
    still = is_holding(seen, drop.terms) and (seen.ground_speed_m_s or 0.0) <= drop.terms.max_ground_speed_m_s
    if not still:
        return replace(drop, calm_since_s=None)
    return drop if drop.calm_since_s is not None else replace(drop, calm_since_s=seen.now_s)


def _before_attempt(drop: DropMachine, seen: Observation) -> tuple[DropMachine, Effects]:
    if seen.connected and drop.approached and is_passed(seen, drop.terms):
        reason = "the hold was over before a release could be sent"
        if drop.phase is DropPhase.WAITING:
            reason = "the mission passed the drop without a hold that was seen"
        return _finish(drop, DropOutcome.KEPT, Certainty.INFERRED, reason)
    if seen.connected and drop.phase is DropPhase.WAITING and is_holding(seen, drop.terms):
        drop = replace(drop, phase=DropPhase.HOLDING)
    if drop.phase is not DropPhase.HOLDING:
        return drop, ()
    if _output(seen) == GRIPPER_OPEN_US:
        reason = "the gripper was open before the release was commanded"
        return _finish_and_resume(drop, seen, DropOutcome.UNKNOWN, Certainty.NONE, reason)
    if _is_hopeless(drop, seen):
        reason = reason_against(seen, drop.terms, drop.hold) or "the hold is over"
        return _finish_and_resume(drop, seen, DropOutcome.KEPT, Certainty.INFERRED, reason)
    return _try_release(drop, seen)


def _is_hopeless(drop: DropMachine, seen: Observation) -> bool:
    """Whether no later observation of this hold can allow a release: its time is over, or its start was not seen."""
    return is_holding(seen, drop.terms) and drop.hold.left_s(seen, drop.terms) <= drop.terms.release_latency_s


def _try_release(drop: DropMachine, seen: Observation) -> tuple[DropMachine, Effects]:
    needed_s = drop.terms.reentry_calm_s if drop.was_away else drop.terms.calm_s
    calm = drop.calm_since_s is not None and seen.now_s - drop.calm_since_s >= needed_s
    if not calm or seen.now_s < drop.retry_at_s or reason_against(seen, drop.terms, drop.hold) is not None:
        return drop, ()
    attempt = drop.attempts + 1
    drop = replace(drop, phase=DropPhase.RELEASING, attempts=attempt, in_flight=attempt)
    return drop, (SendRelease(attempt),)


def _acked(drop: DropMachine, heard: ReleaseAck) -> tuple[DropMachine, Effects]:
    ack = heard.ack
    if heard.attempt != drop.in_flight or not ack.is_final:
        return drop, ()
    drop = replace(drop, in_flight=None, retry_at_s=heard.now_s + drop.terms.retry_pause_s)
    if ack.result is MavResult.ACCEPTED:
        if _output(drop.last_seen) is None:
            return _finish_and_resume(
                drop, drop.last_seen, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, "acknowledged, unconfirmed"
            )
        return replace(drop, accepted_at_s=heard.now_s), ()
    if ack.result in _REFUSALS:
        return _conclude(drop, drop.last_seen, f"the vehicle refused the release: {ack.word}")
    # busy with the same action, or cancelled by an opposite one: whether the gripper moved is open
    return replace(drop, unsure=True), ()


def _watch_output(drop: DropMachine, seen: Observation, accepted_at_s: float) -> tuple[DropMachine, Effects]:
    """After ACCEPTED (a timer): the output must have moved too, where it can be seen."""
    if drop.opened:
        return _finish_and_resume(
            drop, seen, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, "acknowledged, and the output moved"
        )
    if seen.now_s - accepted_at_s < drop.terms.output_wait_s:
        return drop, ()
    if not seen.connected or not _output_is_newer_than(seen, accepted_at_s):
        return _finish_and_resume(
            drop, seen, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, "acknowledged; the output was not seen"
        )
    reason = "acknowledged, but the gripper's output did not move"
    return _finish_and_resume(drop, seen, DropOutcome.UNKNOWN, Certainty.NONE, reason)


def _after_attempt(drop: DropMachine, seen: Observation) -> tuple[DropMachine, Effects]:
    """No answer is awaited any more, and none settled it: look at the output, try again, or close."""
    if not seen.connected:
        return drop, ()  # whatever is true on board is true later too: wait for the link or the run's end
    if drop.opened:
        reason = "no final ack, but the gripper's output went to release"
        return _finish_and_resume(drop, seen, DropOutcome.RELEASED, Certainty.INFERRED, reason)
    if is_passed(seen, drop.terms) or _is_hopeless(drop, seen):
        return _conclude(drop, seen, "the hold was over before the release was acknowledged")
    if drop.attempts >= drop.terms.max_attempts:
        return _conclude(drop, seen, f"no final ack in {drop.attempts} attempts")
    return _try_release(drop, seen)


def _conclude(drop: DropMachine, seen: Observation | None, reason: str) -> tuple[DropMachine, Effects]:
    """Close a drop that was commanded and not accepted."""
    if drop.opened:
        outcome, certainty = DropOutcome.RELEASED, Certainty.INFERRED
        reason += "; but the gripper's output went to release"
    elif _output(seen) == GRIPPER_CLOSED_US and seen is not None and seen.connected:
        outcome, certainty = DropOutcome.KEPT, Certainty.INFERRED
        reason += "; the gripper's output is still at grab"
    elif drop.unsure:
        outcome, certainty = DropOutcome.UNKNOWN, Certainty.NONE
    else:
        outcome, certainty = DropOutcome.KEPT, _certainty_kept(drop)
    return _finish_and_resume(drop, seen, outcome, certainty, reason)


def _ended(drop: DropMachine, heard: RunEnding) -> tuple[DropMachine, Effects]:
    if not drop.attempts:
        return _finish(drop, DropOutcome.KEPT, Certainty.INFERRED, heard.reason)
    if drop.accepted_at_s is not None:
        return _finish(drop, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, "acknowledged; then " + heard.reason)
    if drop.opened:
        reason = f"no final ack, but the gripper's output went to release; {heard.reason}"
        return _finish(drop, DropOutcome.RELEASED, Certainty.INFERRED, reason)
    if drop.in_flight is not None or drop.unsure:
        return _finish(drop, DropOutcome.UNKNOWN, Certainty.NONE, heard.reason)
    return _finish(drop, DropOutcome.KEPT, _certainty_kept(drop), heard.reason)


def _certainty_kept(drop: DropMachine) -> Certainty:
    """A refusal is an acknowledgement; a release that was never sent has none."""
    return Certainty.INFERRED if drop.withheld == drop.attempts else Certainty.ACKNOWLEDGED


def _finish(
    drop: DropMachine, outcome: DropOutcome, certainty: Certainty, reason: str
) -> tuple[DropMachine, tuple[Finish]]:
    return replace(drop, phase=DropPhase.DONE, in_flight=None), (Finish(outcome, certainty, reason),)


def _finish_and_resume(
    drop: DropMachine, seen: Observation | None, outcome: DropOutcome, certainty: Certainty, reason: str
) -> tuple[DropMachine, Effects]:
    """Finish, and move on only if the mission surely waits at this drop for as long as that may take: somebody else's
    choice is never undone, and an item that the mission has gone on to by itself is never flown to again.
    """
    drop, finished = _finish(drop, outcome, certainty, reason)
    waits = seen is not None and seen.connected and is_holding(seen, drop.terms)
    waits = waits and seen is not None and drop.hold.left_s(seen, drop.terms) > drop.terms.resume_s
    return drop, (*finished, Resume(drop.terms.resume_seq)) if waits else finished


def _output(seen: Observation | None) -> int | None:
    return None if seen is None else seen.fresh_output_us


def _output_is_newer_than(seen: Observation, when_s: float) -> bool:
    return seen.gripper_output_age_s is not None and seen.now_s - seen.gripper_output_age_s > when_s
