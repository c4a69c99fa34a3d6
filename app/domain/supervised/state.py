"""The state of one supervised drop, and what may be asked of it; `step` in machine.py changes it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from app.domain.consent import ConsentState
from app.domain.drop import DropPhase
from app.domain.supervised.checks import reason_against
from app.domain.supervised.consent_gate import ConsentGate
from app.domain.supervised.hold import HoldClock
from app.domain.supervised.inputs import Observation
from app.domain.supervised.terms import LATE_SIGN_S, DropTerms


@dataclass(frozen=True, slots=True)
class DropMachine:
    """The state of one supervised drop.

    `in_flight` is the attempt whose final ack is awaited. `unsure` says that some attempt had no final answer, so the
    parcel may be gone. `opened`: the output was seen at release after one; a later output (900 when disarmed) takes
    nothing from that. `withheld` counts attempts that were never sent. `approached` is set once the mission was seen
    before or at the hold, so that a stale index from an earlier flight does not count as passed. `accepted_at_s` is
    set while the gripper's output is watched after an ACCEPTED. `settles_at_s`: after a restart of ours, when the
    output has had its time to move for a release that had just left.

    Laws (tests/unit/domain/supervised/test_supervised_laws.py): no release is sent unless every check holds at that
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
