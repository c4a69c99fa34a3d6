"""What a run makes of its job, and of its vehicle's queue."""

from __future__ import annotations

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.jobs.job import Job, JobState, after, must_be_taken_off, why_bad
from app.domain.jobs.queue import VehicleQueue
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import Run, RunState
from tests.support.job_examples import a_job, a_run
from tests.support.reasons import some

NOW = 100.0
CANCELLED = Reason.of(ReasonCode.JOB_CANCELLED, actor="desk")
GIVEN = a_job(state=JobState.PREPARING, vehicle_id="v1", run_id="run-1")
PREPARED = GIVEN.model_copy(update={"state": JobState.PREPARED})
FLYING = GIVEN.model_copy(update={"state": JobState.FLYING})


def kept(run: Run, outcome: DropOutcome = DropOutcome.KEPT) -> Run:
    """The same run with its parcel still on board, or perhaps."""
    return run.with_drop(run.drops[0].model_copy(update={"outcome": outcome}), now=NOW)


@pytest.mark.parametrize(
    ("job", "run", "state"),
    [
        (GIVEN, None, JobState.QUEUED),
        (GIVEN, a_run(RunState.UPLOADING), JobState.PREPARING),
        (GIVEN, a_run(RunState.UPLOADED), JobState.PREPARED),
        (GIVEN, a_run(RunState.FAILED, reason=some("no answer")), JobState.FAILED),
        (GIVEN, a_run(RunState.FAILED, reason=Reason.of(ReasonCode.RESTART_BEFORE_UPLOAD_ENDED)), JobState.QUEUED),
        (PREPARED, a_run(RunState.STARTING), JobState.PREPARED),
        (PREPARED, a_run(RunState.FLYING, started_at=1.0), JobState.FLYING),
        (PREPARED, a_run(RunState.ABORTED, reason=Reason.of(ReasonCode.ABORTED_ON_GROUND)), JobState.CANCELLED),
        (FLYING, a_run(RunState.PAUSED, started_at=1.0), JobState.FLYING),
        (FLYING, a_run(RunState.COMPLETED, started_at=1.0), JobState.COMPLETED),
        (FLYING, kept(a_run(RunState.COMPLETED, started_at=1.0)), JobState.FAILED),
        (FLYING, a_run(RunState.ABORTED, started_at=1.0), JobState.FAILED),
        (FLYING, a_run(RunState.LOST, started_at=1.0), JobState.FAILED),
    ],
)
def test_a_job_follows_its_run(job: Job, run: Run | None, state: JobState) -> None:
    assert after(job, run, NOW).state is state


def test_a_run_that_was_taken_off_ends_the_job_as_was_asked() -> None:
    run = a_run(RunState.ABORTED, reason=Reason.of(ReasonCode.ABORTED_ON_GROUND))
    for asked, state in (("cancelled", JobState.CANCELLED), ("expired", JobState.EXPIRED)):
        ended = after(PREPARED.model_copy(update={"end_requested": asked, "reason": some()}), run, NOW)
        assert (ended.state, ended.reason, ended.end_requested) == (state, some(), "")


@pytest.mark.parametrize(
    ("run", "state"),
    [
        (a_run(RunState.FAILED, reason=Reason.of(ReasonCode.OTHER_MISSION_ON_BOARD)), JobState.CANCELLED),
        (a_run(RunState.LOST, reason=Reason.of(ReasonCode.NOT_SEEN_AFTER_RESTART)), JobState.FAILED),
        (a_run(RunState.FAILED, started_at=1.0, reason=some()), JobState.FAILED),
    ],
    ids=["not started", "perhaps started", "started"],
)
def test_a_job_that_was_cancelled_ends_so_unless_its_run_may_have_flown(run: Run, state: JobState) -> None:
    asked = PREPARED.model_copy(update={"end_requested": "cancelled", "reason": CANCELLED})
    ended = after(asked, run, NOW)
    assert (ended.state, ended.end_requested) == (state, "")
    assert (ended.reason == CANCELLED) is (state is JobState.CANCELLED)


def test_a_job_that_was_cancelled_while_its_run_was_made_ends_and_does_not_wait_again() -> None:
    asked = GIVEN.model_copy(update={"end_requested": "cancelled", "reason": CANCELLED})
    broken_off = a_run(RunState.FAILED, reason=Reason.of(ReasonCode.RESTART_BEFORE_UPLOAD_ENDED))
    for ended in (after(asked, None, NOW), after(asked, broken_off, NOW), asked.requeued("taken", now=NOW)):
        assert (ended.state, ended.reason) == (JobState.CANCELLED, CANCELLED)


def test_only_a_run_that_does_not_fly_yet_is_taken_off() -> None:
    ending = PREPARED.model_copy(update={"end_requested": "cancelled"})
    for state in RunState:
        may = state in (RunState.CREATED, RunState.UPLOADING, RunState.UPLOADED, RunState.STARTING)
        assert must_be_taken_off(ending, a_run(state), is_late=False) is may
        assert must_be_taken_off(PREPARED, a_run(state), is_late=True) is may
        assert not must_be_taken_off(PREPARED, a_run(state), is_late=False)


def test_a_start_that_failed_is_told_and_one_that_was_not_tried_yet_is_not() -> None:
    asked = PREPARED.model_copy(update={"start_requested_at": 50.0})
    assert after(asked, a_run(RunState.UPLOADED, updated_at=40.0, reason=some("verified")), NOW) is asked
    assert after(asked, a_run(RunState.UPLOADED, updated_at=60.0, reason=some("arming denied")), NOW).reason == some(
        "arming denied"
    )


@pytest.mark.parametrize(
    ("run", "bad"),
    [
        (a_run(RunState.COMPLETED), False),
        (kept(a_run(RunState.COMPLETED)), True),
        (kept(a_run(RunState.COMPLETED), DropOutcome.UNKNOWN), True),
        (a_run(RunState.ABORTED), True),
        (a_run(RunState.FAILED, reason=some("lost")), True),
        (a_run(RunState.LOST), True),
        (a_run(RunState.FAILED, reason=Reason.of(ReasonCode.RESTART_BEFORE_UPLOAD_ENDED)), False),
    ],
)
def test_a_run_that_ended_badly_stops_the_queue_once(run: Run, bad: bool) -> None:
    assert (why_bad(run) is not None) is bad
    queue = VehicleQueue(vehicle_id="v1").judged(run, now=NOW)
    assert (queue.stopped, "run-1" in describe(queue.reason)) == (bad, bad)
    on = queue.resumed_by("ward 3", run, now=NOW)
    assert not on.judged(run, now=NOW).stopped, "who said go on has seen this run"
    other = run.model_copy(update={"id": "run-2"})
    assert on.judged(other, now=NOW).stopped is bad


def test_a_run_that_is_not_over_stops_nothing() -> None:
    queue = VehicleQueue(vehicle_id="v1")
    for run in (None, a_run(RunState.FLYING), a_run(RunState.UPLOADED)):
        assert queue.judged(run, now=NOW) is queue
