"""What becomes of a job that has a vehicle, by what its run has become. It only follows: nothing is commanded here."""

from __future__ import annotations

from app.domain.jobs.job import Job, JobState
from app.domain.jobs.verdict import was_broken_off, why_bad
from app.domain.reason import ReasonCode, because
from app.domain.run import NOT_STARTED, Run, RunState

NEVER_MADE = because(ReasonCode.JOB_RUN_NEVER_MADE)
STARTED_FIRST = because(ReasonCode.JOB_STARTED_FIRST)
WAITS_FOR_START = because(ReasonCode.JOB_WAITS_FOR_START)


def after(job: Job, run: Run | None, now: float) -> Job:
    """The job as its run makes it; the same one if nothing changed. `run` None: it was never made."""
    if run is None:
        return job.requeued(NEVER_MADE, now=now)
    if run.is_over:
        return _ended(job, run, now)
    if run.started_at is not None:
        if job.state is not JobState.FLYING:
            reason = STARTED_FIRST if job.end_asked else None
            return job.moved_to(JobState.FLYING, now=now, reason=reason, end_asked="")
        return job
    if job.state is JobState.PREPARING and run.state is RunState.UPLOADED:
        return job.moved_to(JobState.PREPARED, now=now, reason=None if job.auto_start else WAITS_FOR_START)
    if _start_failed(job, run) and run.reason != job.reason:
        return job.changed(now=now, reason=run.reason)
    return job


def must_be_taken_off(job: Job, run: Run, now: float) -> bool:
    """Whether the run is to be ended on the ground: the job was cancelled, or its latest start is over."""
    return run.state in NOT_STARTED and (bool(job.end_asked) or job.is_late(now))


def _start_failed(job: Job, run: Run) -> bool:
    """Whether the start that we asked for failed on the ground. We do not ask again; a person may."""
    asked_at = job.start_asked_at
    return asked_at is not None and run.state is RunState.UPLOADED and run.updated_at > asked_at


def _ended(job: Job, run: Run, now: float) -> Job:
    if run.state is RunState.ABORTED and run.started_at is None:
        reason = job.reason if job.end_asked else because(ReasonCode.JOB_RUN_ENDED, run.reason)
        return job.moved_to(JobState(job.end_asked or "cancelled"), now=now, reason=reason)
    if was_broken_off(run) and (job.end_asked or job.state is JobState.PREPARING):
        return job.requeued(run.reason, now=now)
    bad = why_bad(run)
    return job.moved_to(JobState.COMPLETED if bad is None else JobState.FAILED, now=now, reason=bad)
