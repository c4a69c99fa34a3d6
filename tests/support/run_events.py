"""The events of a run, numbered as the journal does."""

from __future__ import annotations

from typing import Any

from app.domain.drop.consent import ConsentRecord, ConsentState
from app.domain.drop.record import Certainty, DropOutcome, DropPhase, DropRecord
from app.domain.events import AnyPayload, Event
from app.domain.events.run import RunChanged, RunCreated, RunDrop
from app.domain.run.run import Run, RunState


def new_run(*drops: str, state: RunState = RunState.CREATED) -> Run:
    """Run r1 with these drops."""
    records = tuple(DropRecord(plan_item_id=name, supervised=True) for name in drops or ("drop",))
    return Run(
        id="r1",
        plan_id="plan-1",
        plan_hash="ab",
        vehicle_id="v1",
        state=state,
        drops=records,
        created_at=1.0,
        updated_at=1.0,
    )


class RunEvents:
    """Numbers a run's events."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.seq = 0

    def event(self, data: AnyPayload) -> Event:
        """The next event."""
        self.seq += 1
        return Event(
            kind=data.kind,
            time=1000.0 + self.seq,
            vehicle_id="v1",
            run_id=self.run.id,
            data=data,
            seq=self.seq,
            gateway="gw-1",
            hash=f"{self.seq:064x}",
        )

    def created(self) -> Event:
        """run.created."""
        return self.event(RunCreated(self.run))

    def changed(self, **changes: Any) -> Event:
        """run.changed with the whole run."""
        self.run = self.run.model_copy(update=changes)
        return self.event(RunChanged(self.run))

    def asked(self, name: str, question: int, state: ConsentState = ConsentState.ASKED) -> Event:
        """run.drop with an operator's consent as it stands."""
        consent = ConsentRecord(state=state, question=question, deadline_at=1234.5)
        record = self.run.drop(name).model_copy(update={"consent": consent})
        self.run = self.run.with_drop(record, now=2000.0)
        return self.event(RunDrop(record))

    def dropped(self, name: str, outcome: DropOutcome, certainty: Certainty = Certainty.ACKNOWLEDGED) -> Event:
        """run.drop with a drop that ended."""
        changes = {"phase": DropPhase.DONE, "outcome": outcome, "certainty": certainty}
        record = self.run.drop(name).model_copy(update=changes)
        self.run = self.run.with_drop(record, now=2000.0)
        return self.event(RunDrop(record))
