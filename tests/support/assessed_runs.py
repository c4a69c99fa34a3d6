"""`waydrop fly` ends with 0 only if every drop was released, surely enough, and the run completed."""

from __future__ import annotations

from app.domain.drop.record import Certainty, DropOutcome, DropRecord
from app.domain.reasons import Reason
from app.domain.run.run import Run, RunState


def a_run(state: RunState = RunState.COMPLETED, *drops: DropRecord, reason: Reason | None = None) -> Run:
    return Run(
        id="r1",
        plan_id="p1",
        plan_hash="h",
        vehicle_id="v1",
        state=state,
        reason=reason,
        drops=drops,
        created_at=1.0,
        updated_at=2.0,
    )


def a_drop(outcome: DropOutcome, certainty: Certainty = Certainty.NONE, reason: Reason | None = None) -> DropRecord:
    return DropRecord(plan_item_id="clinic", supervised=True, outcome=outcome, certainty=certainty, reason=reason)


INFERRED = a_drop(DropOutcome.RELEASED, Certainty.INFERRED)
ACKNOWLEDGED = a_drop(DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)
