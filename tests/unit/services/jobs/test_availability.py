"""Whether a vehicle may have the next job follows from its newest run that tells what it carries."""

from __future__ import annotations

import pytest

from app.domain.jobs.job import JobState
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import Run, RunState
from app.services.jobs.availability import EARLIER_AT_ONCE
from tests.support.job_examples import a_run
from tests.support.job_service import JobService, job_service

BROKEN_OFF = Reason.of(ReasonCode.RESTART_BEFORE_UPLOAD_ENDED)


def flown(service: JobService, *runs: Run) -> None:
    """What an earlier process has left, the oldest first."""
    service.events.runs |= {run.id: run for run in runs}


def broken_off(number: int) -> Run:
    return a_run(RunState.FAILED, id=f"broken-{number}", reason=BROKEN_OFF)


BAD = a_run(RunState.ABORTED, id="bad", started_at=1.0)


@pytest.mark.parametrize("count", [1, 2, EARLIER_AT_ONCE + 5])
async def test_runs_that_a_restart_broke_off_do_not_hide_the_bad_one_before_them(count: int) -> None:
    async with job_service() as service:
        flown(service, BAD, *[broken_off(number) for number in range(count)])
        job = await service.order(vehicle="v1", auto_start=True)
        await service.until(lambda: bool(service.events.queues), "the queue must be stopped")
        await service.some_passes()
        assert (service.job(job).state, service.armed()) == (JobState.QUEUED, 0)
        assert "run bad ended" in describe(service.events.queues["v1"].reason)
        await service.jobs.resume("v1", "ward 3")
        assert service.events.queues["v1"].cleared_run_id == "bad"
        await service.until_state(job, "flying")


async def test_a_run_that_an_operator_has_cleared_is_not_judged_again_after_one_that_was_broken_off() -> None:
    async with job_service() as service:
        flown(service, BAD)
        await service.jobs.resume("v1", "ward 3")
        flown(service, broken_off(1))
        await service.until_state(await service.order(vehicle="v1"), "prepared")


async def test_a_vehicle_whose_runs_were_all_broken_off_carries_nothing_that_is_known() -> None:
    async with job_service() as service:
        flown(service, broken_off(1), broken_off(2))
        await service.until_state(await service.order(vehicle="v1"), "prepared")
