"""Whether a run concluded well, so that its vehicle's next job may follow."""

from __future__ import annotations

from app.domain.drop import DropOutcome
from app.domain.reason import Reason, ReasonCode, because
from app.domain.run import Run, RunState


def was_broken_off(run: Run) -> bool:
    """Whether our restart ended it before anything was started: no fault of the vehicle."""
    nothing_started = run.reason is not None and run.reason.code is ReasonCode.RESTART_BEFORE_UPLOAD_ENDED
    return run.state is RunState.FAILED and run.started_at is None and nothing_started


def why_bad(run: Run) -> Reason | None:
    """Why nobody should fly on without looking; None for one that flew its mission and released every parcel.

    A parcel that is still on board, or may be, would fly with the next job.
    """
    if was_broken_off(run):
        return None
    if run.state is not RunState.COMPLETED:
        code = ReasonCode.RUN_BAD if run.reason is None else ReasonCode.RUN_BAD_BECAUSE
        return because(code, run.reason, run_id=run.id, state=run.state.value)
    for drop in run.last_drops:
        if drop.outcome is not DropOutcome.RELEASED:
            code = ReasonCode.DROP_BAD if drop.reason is None else ReasonCode.DROP_BAD_BECAUSE
            about = {"run_id": run.id, "plan_item_id": drop.plan_item_id, "outcome": drop.outcome.value}
            return because(code, drop.reason, **about)
    return None
