"""What the drop's machine knows of an operator's consent, written into the drop's record."""

from __future__ import annotations

from typing import Final

from app.domain.consent import Answer, ConsentChecks, ConsentRecord, ConsentState
from app.domain.flight.look import Look, offset_m
from app.domain.mission import CompiledDrop
from app.domain.reason import Reason, ReasonCode, because
from app.domain.supervised import ConsentGate

_MEASURED: Final = (
    *("ground_speed_m_s", "relative_altitude_m", "landed", "position_age_s"),
    *("battery_percent", "gnss_satellites"),
)
LEFT_HOLD: Final = because(ReasonCode.CONSENT_LEFT_HOLD)
RESTARTED: Final = because(ReasonCode.CONSENT_RESTARTED)


def asked(gate: ConsentGate, seen: Look, compiled: CompiledDrop, hold_left_s: float) -> ConsentRecord:
    """The record of a new question, with what is measured as it is asked."""
    measured = {name: getattr(seen.state, name) for name in _MEASURED}
    return ConsentRecord(
        state=ConsentState.ASKED,
        question=gate.question,
        asked_at=seen.time_s,
        deadline_at=seen.time_s + gate.deadline_s - seen.now_s,
        checked=ConsentChecks(offset_m=offset_m(seen.state, compiled), hold_left_s=hold_left_s, **measured),
    )


def closed(record: ConsentRecord, state: ConsentState | None, reason: Reason) -> ConsentRecord:
    """The record of a question to which nobody answers any more."""
    if state is ConsentState.TIMED_OUT and record.state is ConsentState.ASKED:
        return record.model_copy(update={"state": state})
    return withdrawn(record, reason) if state is ConsentState.WITHDRAWN else record


def answered(record: ConsentRecord, answer: Answer, by: str, seen: Look) -> ConsentRecord:
    """The record with the answer that counts."""
    told = {"state": answer.state, "answered_at": seen.time_s, "answered_by": by, "comment": answer.comment}
    return record.model_copy(update=told)


def withdrawn(record: ConsentRecord, reason: Reason) -> ConsentRecord:
    """The record of a question, or of a grant that was not made use of, that does not matter any more."""
    if record.state not in (ConsentState.ASKED, ConsentState.GRANTED):
        return record
    return record.model_copy(update={"state": ConsentState.WITHDRAWN, "reason": reason})
