"""Where a supervised drop stands with the operator's consent. Pure: it neither asks nor knows who answers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from app.domain.consent import SHORTEST_QUESTION_S, ConsentState
from app.domain.reason import Reason, ReasonCode, because
from app.domain.supervised.hold import HoldClock
from app.domain.supervised.inputs import Observation
from app.domain.supervised.terms import DropTerms
from app.domain.vehicle import FlightMode

ANSWER_S: Final = 1.0
"""From the last moment for an answer to the command: it is stored, and all checks are made again."""

_AGAINST: Final = {
    ConsentState.REFUSED: because(ReasonCode.CONSENT_REFUSED),
    ConsentState.TIMED_OUT: because(ReasonCode.CONSENT_TIMED_OUT),
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
