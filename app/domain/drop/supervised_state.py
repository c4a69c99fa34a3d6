"""The state of a supervised drop, and what must be true before its release is sent."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.drop.consent import SHORTEST_QUESTION_S, ConsentState
from app.domain.drop.record import DropPhase
from app.domain.drop.supervised_inputs import LATE_SIGN_S, DropTerms, HoldClock, Observation
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import FlightMode, LandedState

# What must be true at the moment a release is sent. Checked again before each try.


def is_holding(seen: Observation, terms: DropTerms) -> bool:
    """Arrival: the hold item is current, in Mission mode, inside the radius. Never judged by progress messages."""
    return (
        seen.mode is FlightMode.MISSION
        and seen.mission_seq in terms.hold_seqs
        and seen.offset_m is not None
        and seen.offset_m <= terms.acceptance_radius_m + terms.max_offset_m
    )


def is_passed(seen: Observation, terms: DropTerms) -> bool:
    """The mission is beyond the hold: whatever was not commanded by now is not commanded any more."""
    return (
        seen.mode is FlightMode.MISSION
        and seen.mission_seq is not None
        and seen.mission_seq not in terms.hold_seqs
        and seen.mission_seq > max(terms.hold_seqs)
    )


def reason_against(seen: Observation, terms: DropTerms, hold: HoldClock) -> Reason | None:
    """Why a release must not be sent now, or None if it may be."""
    return (
        _link_reason(seen, terms)
        or _place_reason(seen, terms)
        or _target_reason(seen, terms)
        or _time_reason(seen, terms, hold)
    )


def _link_reason(seen: Observation, terms: DropTerms) -> Reason | None:
    if not seen.connected:
        return Reason.of(ReasonCode.LINK_LOST)
    if seen.in_failsafe:
        return Reason.of(ReasonCode.IN_FAILSAFE)
    if seen.armed is not True:
        return Reason.of(ReasonCode.NOT_ARMED)
    if seen.mode is not FlightMode.MISSION:
        return Reason.of(ReasonCode.WRONG_MODE, mode=seen.mode.value if seen.mode else "an unknown")
    if seen.mission_seq not in terms.hold_seqs:
        return Reason.of(ReasonCode.NOT_CURRENT)
    if seen.position_age_s is None or seen.position_age_s > terms.max_position_age_s:
        return Reason.of(ReasonCode.POSITION_OLD)
    return None


def _place_reason(seen: Observation, terms: DropTerms) -> Reason | None:
    if seen.offset_m is None or not seen.offset_m <= terms.max_offset_m:
        return Reason.of(ReasonCode.TOO_FAR, max_offset_m=terms.max_offset_m)
    if seen.ground_speed_m_s is None or not seen.ground_speed_m_s <= terms.max_ground_speed_m_s:
        return Reason.of(ReasonCode.TOO_FAST, max_ground_speed_m_s=terms.max_ground_speed_m_s)
    if terms.landed and seen.landed is not LandedState.ON_GROUND:
        return Reason.of(ReasonCode.NOT_ON_GROUND)
    return None


def _target_reason(seen: Observation, terms: DropTerms) -> Reason | None:
    """Of a drop at a moving target: it must be known where it is now, and it must be here."""
    if terms.target_max_speed_m_s is None:
        return None
    target = seen.target
    if target is None:
        return Reason.of(ReasonCode.TARGET_UNKNOWN)
    if not target.age_s <= terms.max_target_age_s:
        return Reason.of(ReasonCode.TARGET_OLD, max_age_s=terms.max_target_age_s)
    if not target.speed_m_s <= terms.target_max_speed_m_s:
        return Reason.of(ReasonCode.TARGET_FAST, max_speed_m_s=terms.target_max_speed_m_s)
    if target.distance_m is None or not target.distance_m <= terms.max_offset_m:
        return Reason.of(ReasonCode.TARGET_AWAY, max_offset_m=terms.max_offset_m)
    return None


def _time_reason(seen: Observation, terms: DropTerms, hold: HoldClock) -> Reason | None:
    if hold.not_begun_at_s is None:
        return Reason.of(ReasonCode.HOLD_START_UNSEEN)
    if hold.left_s(seen, terms) <= terms.release_latency_s:
        return Reason.of(ReasonCode.HOLD_TOO_SHORT)
    return None


# Where a supervised drop stands with the operator's consent. Pure: it neither asks nor knows who answers.


ANSWER_S: Final = 1.0
"""From the last moment for an answer to the command: it is stored, and all checks are made again."""

_AGAINST: Final = {
    ConsentState.REFUSED: Reason.of(ReasonCode.CONSENT_REFUSED),
    ConsentState.TIMED_OUT: Reason.of(ReasonCode.CONSENT_TIMED_OUT),
}


@dataclass(frozen=True, slots=True)
class ConsentGate:
    """`state` None: none is needed. `question` counts the questions; `deadline_s` is our monotonic time.

    A grant is good for all tries within the hold in which it was asked, and for no other hold.
    """

    state: ConsentState | None = None
    question: int = 0
    deadline_s: float = math.inf

    @property
    def is_open(self) -> bool:
        """Whether a release may pass."""
        return self.state in (None, ConsentState.GRANTED)

    @property
    def must_ask(self) -> bool:
        """Whether nobody was asked in this hold yet."""
        return self.state in (ConsentState.PENDING, ConsentState.WITHDRAWN)

    @property
    def reason_against(self) -> Reason | None:
        """Why there will be no release in this hold; None while there may be one."""
        return None if self.state is None else _AGAINST.get(self.state)

    def asked(self, seen: Observation, terms: DropTerms, hold: HoldClock) -> ConsentGate | None:
        """The gate with its next question; None if too little of the hold is left to answer one."""
        longest_s = hold.left_s(seen, terms) - terms.release_latency_s - ANSWER_S
        if longest_s < SHORTEST_QUESTION_S:
            return None
        wait_s = min(longest_s, terms.consent_timeout_s or math.inf)
        return ConsentGate(ConsentState.ASKED, self.question + 1, seen.now_s + wait_s)

    def answered(self, question: int, *, grant: bool, now_s: float) -> ConsentGate:
        """The gate after an answer; unchanged if that is not the question, or too late."""
        if self.state is not ConsentState.ASKED or question != self.question or now_s >= self.deadline_s:
            return self
        return replace(self, state=ConsentState.GRANTED if grant else ConsentState.REFUSED)

    def at(self, now_s: float) -> ConsentGate:
        """The gate as time goes by."""
        if self.state is ConsentState.ASKED and now_s >= self.deadline_s:
            return replace(self, state=ConsentState.TIMED_OUT)
        return self

    def observed(self, seen: Observation, terms: DropTerms) -> ConsentGate:
        """The gate after an observation: whoever leaves the hold and comes back is asked for anew."""
        gate = self.at(seen.now_s)
        away = seen.mode is not FlightMode.MISSION or seen.mission_seq not in terms.hold_seqs
        return gate.withdrawn() if seen.connected and away else gate

    def withdrawn(self, *, at_end: bool = False) -> ConsentGate:
        """The gate after its hold. At the drop's end what was granted stays granted: it is evidence."""
        ends = self.state is ConsentState.ASKED or (not at_end and self.state is ConsentState.GRANTED)
        return replace(self, state=ConsentState.WITHDRAWN) if ends else self


# The state of one supervised drop, and what may be asked of it; `step` in supervised.py changes it.


@dataclass(frozen=True, slots=True)
class DropMachine:
    """The state of one supervised drop.

    `in_flight` is the attempt whose final ack is awaited. `unsure` says that some attempt had no final answer, so the
    parcel may be gone. `opened`: the output was seen at release after one; a later output (900 when disarmed) takes
    nothing from that. `withheld` counts attempts that were never sent. `approached` is set once the mission was seen
    before or at the hold, so that a stale index from an earlier flight does not count as passed. `accepted_at_s` is
    set while the gripper's output is watched after an ACCEPTED. `settles_at_s`: after a restart of ours, when the
    output has had its time to move for a release that had just left.

    Laws (tests/unit/domain/drop/test_supervised_laws.py): no release is sent unless every check holds at that
    moment; none after an ACCEPTED; one at a time; one Finish; `kept` never while unsure; `released` never without
    evidence; where consent is needed, no release without a grant given in the very same hold.
    """

    terms: DropTerms
    phase: DropPhase = DropPhase.WAITING
    hold: HoldClock = field(default_factory=HoldClock)
    consent: ConsentGate = field(default_factory=ConsentGate)
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
    settles_at_s: float = 0.0
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
        right = self.consent.is_open and reason_against(seen, self.terms, self.hold) is None
        return self.in_flight is not None and right

    def send_before_s(self, seen: Observation) -> float:
        """Our monotonic time after which a release must not leave any more: the hold would not cover its latency."""
        return seen.now_s + self.hold.left_s(seen, self.terms) - self.terms.release_latency_s

    @classmethod
    def taken_up(cls, terms: DropTerms, attempts: int, *, opened: bool = False, questions: int = 0) -> DropMachine:
        """The machine at first (no `attempts`, no `questions` were), or after a restart of ours.

        Releases that were commanded and not settled are never sent again: what became of them can only be looked at.
        A consent of before does not count any more. `opened`: see the class.
        """
        consent = ConsentGate(ConsentState.PENDING, questions) if terms.needs_consent else ConsentGate()
        if attempts == 0:
            return cls(terms, consent=consent)
        return cls(
            terms,
            phase=DropPhase.RELEASING,
            consent=consent,
            approached=True,
            attempts=terms.max_attempts,
            unsure=True,
            opened=opened,
        )
