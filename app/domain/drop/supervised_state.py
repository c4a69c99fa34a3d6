"""The state of a supervised drop, and the conditions of a release."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.drop.consent import SHORTEST_QUESTION_S, ConsentState
from app.domain.drop.record import DropPhase, GripperUse
from app.domain.drop.supervised_inputs import (
    GRIPPER_CLOSED_US,
    GRIPPER_OPEN_US,
    LATE_SIGN_S,
    LOADED_S,
    DropObservation,
    DropTerms,
    HoldClock,
    output_of,
)
from app.domain.model import changed
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import AIRBORNE, WITHOUT_FIX, FlightMode, LandedState

# Conditions of a release, checked again before each attempt.


def is_holding(seen: DropObservation, terms: DropTerms) -> bool:
    """Arrival: the hold item is current, in Mission mode, inside the radius. Never judged by progress messages."""
    return (
        seen.mode is FlightMode.MISSION
        and seen.mission_seq in terms.hold_seqs
        and seen.offset_m is not None
        and seen.offset_m <= terms.acceptance_radius_m + terms.max_offset_m
    )


def is_passed(seen: DropObservation, terms: DropTerms) -> bool:
    """The mission is beyond the hold: whatever was not commanded by now is not commanded any more."""
    return (
        seen.mode is FlightMode.MISSION
        and seen.mission_is_sure
        and seen.mission_seq is not None
        and seen.mission_seq not in terms.hold_seqs
        and seen.mission_seq > max(terms.hold_seqs)
    )


def reason_against(seen: DropObservation, terms: DropTerms, hold: HoldClock) -> Reason | None:
    """Why a release must not be sent now, or None if it may be."""
    return (
        _link_reason(seen, terms)
        or _place_reason(seen, terms)
        or _target_reason(seen, terms)
        or _time_reason(seen, terms, hold)
    )


def _link_reason(seen: DropObservation, terms: DropTerms) -> Reason | None:
    if not seen.connected:
        return Reason.of(ReasonCode.LINK_LOST)
    if seen.in_failsafe:
        return Reason.of(ReasonCode.IN_FAILSAFE)
    if seen.armed is not True:
        return Reason.of(ReasonCode.NOT_ARMED)
    if not seen.mission_is_ours:
        return Reason.of(ReasonCode.OTHER_MISSION)
    if seen.mode is not FlightMode.MISSION:
        return Reason.of(ReasonCode.WRONG_MODE, mode=seen.mode.value if seen.mode else "an unknown")
    if seen.mission_seq not in terms.hold_seqs:
        return Reason.of(ReasonCode.NOT_CURRENT)
    if seen.position_age_s is None or seen.position_age_s > terms.max_position_age_s:
        return Reason.of(ReasonCode.POSITION_OLD)
    if seen.gnss_fix in WITHOUT_FIX:
        return Reason.of(ReasonCode.NO_GNSS)
    return None


def _place_reason(seen: DropObservation, terms: DropTerms) -> Reason | None:
    if seen.offset_m is None or not seen.offset_m <= terms.max_offset_m:
        return Reason.of(ReasonCode.TOO_FAR, max_offset_m=terms.max_offset_m)
    if seen.ground_speed_m_s is None or not seen.ground_speed_m_s <= terms.max_ground_speed_m_s:
        return Reason.of(ReasonCode.TOO_FAST, max_ground_speed_m_s=terms.max_ground_speed_m_s)
    if terms.max_height_error_m is not None and not _is_at_height(seen, terms.max_height_error_m):
        return Reason.of(ReasonCode.WRONG_HEIGHT, max_height_error_m=terms.max_height_error_m)
    if terms.landed and seen.landed is not LandedState.ON_GROUND:
        return Reason.of(ReasonCode.NOT_ON_GROUND)
    return None


def _is_at_height(seen: DropObservation, max_error_m: float) -> bool:
    return seen.height_error_m is not None and seen.height_error_m <= max_error_m


def _target_reason(seen: DropObservation, terms: DropTerms) -> Reason | None:
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


def _time_reason(seen: DropObservation, terms: DropTerms, hold: HoldClock) -> Reason | None:
    if hold.not_begun_at_s is None:
        return Reason.of(ReasonCode.HOLD_START_UNSEEN)
    if hold.left_s(seen, terms) <= terms.release_latency_s:
        return Reason.of(ReasonCode.HOLD_TOO_SHORT)
    return None


def may_have_come(items: frozenset[int], seen: DropObservation, terms: DropTerms, *, lost_sight: bool) -> bool:
    """Whether one of these items may have been executed since the drop's hold."""
    at = seen.mission_seq
    if at is None or at < min(terms.hold_seqs) or (terms.others.returns and lost_sight):
        return bool(items)
    return any(max(terms.hold_seqs) < seq <= at for seq in items)


def is_loaded(seen: DropObservation, terms: DropTerms) -> bool:
    """Whether it flies, and the mission has not opened the gripper, nor closes it before this drop."""
    others, at = terms.others, seen.mission_seq
    if not seen.connected or seen.armed is not True or seen.landed not in AIRBORNE:
        return False
    if not (others.releases or others.grabs) or not seen.mission_is_ours:
        return True
    if at is None or others.returns:
        return False
    had = [seq for seq in others.releases | others.grabs if seq <= at]
    return not (had and max(had) in others.releases) and not others.grabs_before(min(terms.hold_seqs), at)


ANSWER_S: Final = 1.0
"""Time between the last moment for an answer and the command, to store the answer and repeat all checks."""

_AGAINST: Final = {
    ConsentState.REFUSED: Reason.of(ReasonCode.CONSENT_REFUSED),
    ConsentState.TIMED_OUT: Reason.of(ReasonCode.CONSENT_TIMED_OUT),
}


@dataclass(frozen=True, slots=True)
class ConsentGate:
    """`state` None: no consent is required. `question` counts the requests; `deadline_s` is monotonic time.

    A grant applies to all attempts within the hold in which it was requested, and to no other hold.
    """

    state: ConsentState | None = None
    question: int = 0
    deadline_s: float = math.inf

    @property
    def is_open(self) -> bool:
        """Whether a release may be sent."""
        return self.state in (None, ConsentState.GRANTED)

    @property
    def must_ask(self) -> bool:
        """Whether consent has not been requested in this hold."""
        return self.state in (ConsentState.PENDING, ConsentState.WITHDRAWN)

    @property
    def reason_against(self) -> Reason | None:
        """Return why there will be no release in this hold, None while one is possible."""
        return None if self.state is None else _AGAINST.get(self.state)

    def asked(self, seen: DropObservation, terms: DropTerms, hold: HoldClock) -> ConsentGate | None:
        """The gate with its next question; None if too little of the hold is left to answer one."""
        longest_s = hold.left_s(seen, terms) - terms.release_latency_s - ANSWER_S
        if longest_s < SHORTEST_QUESTION_S:
            return None
        wait_s = min(longest_s, terms.consent_timeout_s or math.inf)
        return ConsentGate(ConsentState.ASKED, self.question + 1, seen.now_s + wait_s)

    def answered(self, question: int, *, grant: bool, now_s: float) -> ConsentGate:
        """Return the gate after an answer; unchanged if it is for another request or too late."""
        if self.state is not ConsentState.ASKED or question != self.question or now_s >= self.deadline_s:
            return self
        return replace(self, state=ConsentState.GRANTED if grant else ConsentState.REFUSED)

    def at(self, now_s: float) -> ConsentGate:
        """Return the gate as time passes."""
        if self.state is ConsentState.ASKED and now_s >= self.deadline_s:
            return replace(self, state=ConsentState.TIMED_OUT)
        return self

    def observed(self, seen: DropObservation, terms: DropTerms) -> ConsentGate:
        """Return the gate after an observation. Leaving the hold requires a new request afterwards."""
        gate = self.at(seen.now_s)
        away = seen.mode is not FlightMode.MISSION or seen.mission_seq not in terms.hold_seqs
        return gate.withdrawn() if seen.connected and away else gate

    def withdrawn(self, *, at_end: bool = False) -> ConsentGate:
        """Return the gate after the hold. A grant stays in the record as evidence."""
        ends = self.state is ConsentState.ASKED or (not at_end and self.state is ConsentState.GRANTED)
        return replace(self, state=ConsentState.WITHDRAWN) if ends else self


@dataclass(frozen=True, slots=True)
class DropMachine:
    """The state of a supervised drop.

    `in_flight` is the attempt whose final acknowledgement is pending. `unsure`: an attempt had no final answer, so the
    parcel may be gone. `opened`: the output was observed at release after an attempt; later pulses (900 when disarmed)
    do not change that. `withheld` counts attempts that were never sent. `approached` is set once the mission was
    observed before or at the hold, so that a stale index of an earlier flight does not count as passed. `accepted_at_s`
    is set while the output is observed after an ACCEPTED. `settles_at_s`: after a restart, when the output has had time
    to move for a release that had just been sent. `lost_sight`: the vehicle was not observed all the time since a
    release may have been sent. `loaded_since_s`: see is_loaded. `used_by`: see DropRecord.

    Laws (tests/unit/domain/drop/test_supervised_laws.py): no release is sent unless every check passes at that moment;
    none after an ACCEPTED; one at a time; one Finish; never `kept` while unsure; only `unknown` once others used the
    gripper; never `released` without evidence; if consent is required, no release without a grant in the same hold.
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
    lost_sight: bool = False
    loaded_since_s: float | None = None
    used_by: GripperUse | None = None
    last_seen: DropObservation | None = None

    @property
    def is_over(self) -> bool:
        """Whether the drop has an outcome."""
        return self.phase is DropPhase.DONE

    def waiting_since(self, not_begun_at_s: float) -> DropMachine:
        """Return the state, given that the journal shows the drop still waiting at this time of the vehicle's clock."""
        return replace(self, hold=HoldClock(not_begun_at_s - LATE_SIGN_S))

    def own_output_of(self, seen: DropObservation | None) -> int | None:
        """The gripper output, unless another item of the mission may have moved it there since the hold."""
        output, others = output_of(seen), self.terms.others
        items = {GRIPPER_OPEN_US: others.releases, GRIPPER_CLOSED_US: others.grabs}.get(output or 0, frozenset())
        if seen is None or may_have_come(items, seen, self.terms, lost_sight=self.lost_sight):
            return None
        return output

    def watched(self, seen: DropObservation) -> DropMachine:
        """Return the state with who opened the gripper of the loaded vehicle, before any command of this drop."""
        if not is_loaded(seen, self.terms) or self.attempts:
            return changed(self, loaded_since_s=None)
        since_s = seen.now_s if self.loaded_since_s is None else self.loaded_since_s
        is_open = output_of(seen) == GRIPPER_OPEN_US and not is_holding(seen, self.terms)
        is_new = seen.now_s - (seen.gripper_output_age_s or 0.0) > since_s + LOADED_S
        used_by = self.used_by or (GripperUse.OTHERS if is_open and is_new else None)
        return changed(self, loaded_since_s=since_s, used_by=used_by)

    def may_send(self, seen: DropObservation) -> bool:
        """Whether the release that is about to go out is still right at this very moment."""
        right = self.consent.is_open and reason_against(seen, self.terms, self.hold) is None
        return self.in_flight is not None and right

    def send_before_s(self, seen: DropObservation) -> float:
        """Our monotonic time after which a release must not leave any more: the hold would not cover its latency."""
        return seen.now_s + self.hold.left_s(seen, self.terms) - self.terms.release_latency_s

    @classmethod
    def recovered(
        cls,
        terms: DropTerms,
        attempts: int,
        *,
        opened: bool = False,
        questions: int = 0,
        accepted: bool = False,
        used_by: GripperUse | None = None,
    ) -> DropMachine:
        """The machine at first (no `attempts`, no `questions` were), or after a restart of ours.

        Releases that were sent and not answered are never repeated; their effect can only be observed. Earlier consent
        is void. `opened`: see the class. `accepted`: ACCEPTED is recorded, of a link that was not open, and the outcome
        is not.
        """
        consent = ConsentGate(ConsentState.PENDING, questions) if terms.needs_consent else ConsentGate()
        if attempts == 0:
            return cls(terms, consent=consent, used_by=used_by)
        return cls(
            replace(terms, max_attempts=attempts),
            phase=DropPhase.RELEASING,
            consent=consent,
            approached=True,
            attempts=attempts,
            unsure=True,
            opened=opened,
            accepted_at_s=0.0 if accepted else None,
            used_by=used_by,
        )
