"""An operator's consent to one release: what was asked, what was answered, and which answer counts."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from pydantic import BaseModel, ConfigDict

from app.domain.errors import ConsentAnsweredError, ConsentNotAskedError, ConsentTooLateError
from app.domain.reasons import Reason, describe
from app.domain.vehicle.state import LandedState

SHORTEST_QUESTION_S: Final = 5.0
"""Nobody can look and decide in less: then it is not asked at all."""
CONSENT_MARGIN_S: Final = 5.0
"""What a hold must last longer than the question: its beginning is seen up to 1.1 s late, the vehicle comes to rest,
the answer is stored, and what is left must still cover the release.
"""


class ConsentState(StrEnum):
    """Where the question stands. `withdrawn`: nobody answered, and it does not matter any more."""

    PENDING = "pending"
    ASKED = "asked"
    GRANTED = "granted"
    REFUSED = "refused"
    TIMED_OUT = "timed_out"
    WITHDRAWN = "withdrawn"


class ConsentChecks(BaseModel):
    """What was measured when it was asked: the vehicle stood still at the point, and all checks held.

    `hold_left_s` is how long the hold surely still lasts; null is "never received".
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    offset_m: float | None = None
    ground_speed_m_s: float | None = None
    relative_altitude_m: float | None = None
    landed: LandedState | None = None
    position_age_s: float | None = None
    battery_percent: float | None = None
    gnss_satellites: int | None = None
    hold_left_s: float | None = None


class ConsentRecord(BaseModel):
    """The consent to one drop, as evidence. Times are Unix seconds.

    `question` counts how often it was asked: a vehicle that leaves its hold and comes back is asked for anew, and an
    earlier answer does not count. `comment` is the operator's own words, `reason` why it was withdrawn.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

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
    """What an operator said. A grant names the question that was seen; a refusal with None is one to whatever is asked.

    Raises:
        ValueError: a grant without a question.
    """

    grant: bool
    question: int | None = None
    comment: str = ""

    def __post_init__(self) -> None:
        if self.grant and self.question is None:
            raise ValueError("a grant names the question that it answers")

    @property
    def state(self) -> ConsentState:
        """What it makes of the question."""
        return ConsentState.GRANTED if self.grant else ConsentState.REFUSED


def is_new_answer(consent: ConsentRecord | None, answer: Answer) -> bool:
    """Whether the answer is the first to this question; False if the same one counted already.

    Raises:
        ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError: it does not count.
    """
    if consent is None:
        raise ConsentNotAskedError("the plan asks for no consent to this drop")
    if consent.state is ConsentState.PENDING:
        raise ConsentNotAskedError("nothing was asked", hint="a drop asks while its vehicle holds there")
    if answer.question not in (None, consent.question):
        raise ConsentNotAskedError(
            f"question {answer.question} is not the one that is asked", question=consent.question
        )
    if consent.state is ConsentState.WITHDRAWN:
        raise ConsentNotAskedError(f"the question was withdrawn: {describe(consent.reason)}")
    if consent.state is ConsentState.TIMED_OUT:
        raise ConsentTooLateError("nobody answered in time: that counts as a refusal")
    if consent.state is ConsentState.ASKED:
        return True
    if consent.state is not answer.state:
        who = consent.answered_by or "somebody"
        raise ConsentAnsweredError(f"{who} has {consent.state.value} it already: the first answer counts")
    return False
