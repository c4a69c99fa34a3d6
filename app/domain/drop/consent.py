"""Operator consent to a release: the request, the answer, and which answer counts."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.errors import ConsentAnsweredError, ConsentNotAskedError, ConsentTooLateError
from app.domain.model import FrozenForm
from app.domain.reasons import Reason, describe
from app.domain.vehicle.state import LandedState

SHORTEST_QUESTION_S: Final = 5.0
"""An operator needs at least this long. If less time is left, consent is not requested."""
SHORTEST_HOLD_S: Final = 5.0
"""The start of the hold is detected up to 1.1 s late, the vehicle comes to rest, and the rest must still cover the
release (flown: nothing was released in 3 s, nor in 3.5 s after 11 m/s).
"""
SHORTEST_STANDING_HOLD_S: Final = 4.0
"""On the ground and on wheels: as above, without coming to rest from a flight (4 s: released in simulated flights)."""
CONSENT_MARGIN_S: Final = SHORTEST_HOLD_S
"""How much longer the hold must be than the time to answer; the answer is stored, too."""


class ConsentState(StrEnum):
    """State of the request. `withdrawn`: nobody answered, and the request no longer applies."""

    PENDING = "pending"
    ASKED = "asked"
    GRANTED = "granted"
    REFUSED = "refused"
    TIMED_OUT = "timed_out"
    WITHDRAWN = "withdrawn"


class ConsentChecks(FrozenForm):
    """Measurements at the time of the request: the vehicle was at rest at the point, and all checks passed.

    `hold_left_s` is the guaranteed remaining hold time; null means never received.
    """

    offset_m: float | None = None
    ground_speed_m_s: float | None = None
    relative_altitude_m: float | None = None
    landed: LandedState | None = None
    position_age_s: float | None = None
    battery_percent: float | None = None
    gnss_satellites: int | None = None
    hold_left_s: float | None = None


class ConsentRecord(FrozenForm):
    """The consent to a drop, as evidence. Times are in Unix seconds.

    `question` counts the requests: when a vehicle leaves its hold and comes back, consent is requested again and
    earlier answers are void. `comment` is the operator's, `reason` says why the request was withdrawn.
    """

    state: ConsentState = ConsentState.PENDING
    question: int = 0
    asked_at: float | None = None
    deadline_at: float | None = None
    checked: ConsentChecks | None = None
    answered_at: float | None = None
    answered_by: str | None = None
    comment: str = ""
    reason: Reason | None = None


@dataclass(frozen=True, slots=True)
class Answer:
    """An operator's answer. A grant names the request; a refusal with None refuses the current request.

    Raises:
        ValueError: a grant without the number of the request.
    """

    grant: bool
    question: int | None = None
    comment: str = ""

    def __post_init__(self) -> None:
        if self.grant and self.question is None:
            raise ValueError("a grant requires the number of the request")

    @property
    def state(self) -> ConsentState:
        """The resulting state of the request."""
        return ConsentState.GRANTED if self.grant else ConsentState.REFUSED


def is_new_answer(consent: ConsentRecord | None, answer: Answer) -> bool:
    """Whether this is the first answer to the request; False if the same answer was already given.

    Raises:
        ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError: the answer does not count.
    """
    if consent is None:
        raise ConsentNotAskedError("the plan does not request consent to this drop")
    if consent.state is ConsentState.PENDING:
        raise ConsentNotAskedError(
            "no consent request is pending", hint="consent is requested while the vehicle holds at the drop"
        )
    if answer.question not in (None, consent.question):
        raise ConsentNotAskedError(f"request {answer.question} is not the current one", question=consent.question)
    if consent.state is ConsentState.WITHDRAWN:
        raise ConsentNotAskedError(f"the request was withdrawn: {describe(consent.reason)}")
    if consent.state is ConsentState.TIMED_OUT:
        raise ConsentTooLateError("the request has expired, which counts as a refusal")
    if consent.state is ConsentState.ASKED:
        return True
    if consent.state is not answer.state:
        who = consent.answered_by or "somebody"
        raise ConsentAnsweredError(f"{who} has already {consent.state.value} it; the first answer counts")
    return False
