"""The queue of one vehicle: whether it goes on, and what an operator has said of it."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from app.domain.jobs.verdict import why_bad
from app.domain.reason import Reason
from app.domain.run import Run


class VehicleQueue(BaseModel):
    """While `stopped`, no job is begun and no start asked. `cleared_run_id`: a run whose end stops it no more."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    vehicle_id: str
    stopped: bool = False
    reason: Reason | None = None
    by: str = ""
    at: float | None = None
    cleared_run_id: str | None = None

    def judged(self, newest: Run | None, *, now: float) -> VehicleQueue:
        """After the vehicle's newest run, whoever made it: one that ended badly stops the queue, once."""
        if self.stopped or newest is None or not newest.is_over or newest.id == self.cleared_run_id:
            return self
        bad = why_bad(newest)
        return self if bad is None else self.stopped_by("waydrop", bad, now=now)

    def stopped_by(self, by: str, reason: Reason, *, now: float) -> VehicleQueue:
        """It stands from now on."""
        return self.model_copy(update={"stopped": True, "reason": reason, "by": by, "at": now})

    def resumed_by(self, by: str, newest: Run | None, *, now: float) -> VehicleQueue:
        """It goes on, whatever the newest run was."""
        cleared = newest.id if newest is not None and newest.is_over else self.cleared_run_id
        given = {"stopped": False, "reason": None, "by": by, "at": now, "cleared_run_id": cleared}
        return self.model_copy(update=given)

    def cleared(self, run_id: str) -> VehicleQueue:
        """That run was taken off the vehicle by the queue itself: its end is no reason to stop."""
        return self.model_copy(update={"cleared_run_id": run_id})
