"""Whether a run concluded well, so that its vehicle's next job may follow."""

from __future__ import annotations

from typing import Final

from app.domain.drop import DropOutcome
from app.domain.run import Run, RunState

NOTHING_STARTED: Final = "Waydrop restarted before the upload ended; nothing was started"
"""The reason of a run that a restart of ours ended on the ground: no fault of the vehicle."""


def was_broken_off(run: Run) -> bool:
    """Whether our restart ended it before anything was started."""
    return run.state is RunState.FAILED and run.started_at is None and run.reason == NOTHING_STARTED


def why_bad(run: Run) -> str | None:
    """Why nobody should fly on without looking; None for one that flew its mission and released every parcel.

    A parcel that is still on board, or may be, would fly with the next job.
    """
    if was_broken_off(run):
        return None
    if run.state is not RunState.COMPLETED:
        return f"run {run.id} ended {run.state.value}" + (f": {run.reason}" if run.reason else "")
    for drop in run.last_drops:
        if drop.outcome is not DropOutcome.RELEASED:
            why = f" ({drop.reason})" if drop.reason else ""
            return f"run {run.id} completed, but drop {drop.plan_item_id} is {drop.outcome.value}{why}"
    return None
