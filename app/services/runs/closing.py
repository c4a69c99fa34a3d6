"""Ends a run whose vehicle cannot be looked at: each drop gets the outcome that its record allows."""

from __future__ import annotations

from app.domain.drop import Certainty, DropOutcome, DropPhase, DropRecord
from app.domain.flight.consent_evidence import withdrawn
from app.domain.reason import Reason, ReasonCode, because
from app.domain.run import Run, RunState
from app.domain.supervised.terms import GRIPPER_OPEN_US
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.runs.recorder import RunRecorder

BEFORE_TAKE_OFF = frozenset({RunState.CREATED, RunState.UPLOADING, RunState.UPLOADED})


async def close_unseen(run: Run, state: RunState, reason: Reason, journal: Journal, clock: Clock) -> Run:
    """Store the run's end. Raises StorageError."""
    recorder = RunRecorder(run, journal, clock)
    for drop in run.drops:
        if drop.phase is not DropPhase.DONE:
            recorder.drop(closed(drop, reason, took_off=run.state not in BEFORE_TAKE_OFF))
    recorder.change(item_id=None)
    recorder.move(state, reason)
    return await recorder.flush()


def closed(drop: DropRecord, reason: Reason, *, took_off: bool) -> DropRecord:
    """A supervised drop that was never commanded is kept; an embedded one may have happened unseen.

    One whose output was seen at release is never kept.
    """
    outcome, certainty = DropOutcome.UNKNOWN, Certainty.NONE
    if drop.output_us == GRIPPER_OPEN_US:
        if drop.commanded_at is not None:
            outcome, certainty = DropOutcome.RELEASED, Certainty.INFERRED
            reason = because(ReasonCode.DROP_ACK_MISSING_RELEASED_THEN, reason)
    elif not took_off or (drop.supervised and drop.attempts == 0):
        outcome, certainty = DropOutcome.KEPT, Certainty.INFERRED
    changes: dict[str, object] = {"phase": DropPhase.DONE, "outcome": outcome, "certainty": certainty, "reason": reason}
    if drop.consent is not None and drop.attempts == 0:
        changes["consent"] = withdrawn(drop.consent, reason)
    return drop.model_copy(update=changes)
