"""What ends a job or stops its queue while its start waits to arm is obeyed; once it is told to arm, it is refused."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from app.domain.errors import JobWrongStateError
from app.domain.jobs.job import Job, JobState
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import Run, RunState
from tests.support.job_service import JobService, job_service
from tests.support.scheduled_jobs import at
from tests.support.scripted_link import FAST

PATIENT = replace(FAST, armable_s=60.0)


def run_of(service: JobService, job: Job) -> Run:
    return service.events.runs[service.job(job).run_id or ""]


@asynccontextmanager
async def waits_to_arm(*, auto_start: bool = True) -> AsyncIterator[tuple[JobService, Job]]:
    """A job whose start has been asked, and whose vehicle refuses to arm, as without GNSS."""
    async with job_service(settings=PATIENT) as service:
        service.vehicles[0].arm_refusals = 1_000_000
        job = await service.order(vehicle="v1", auto_start=auto_start, deadline=at(service, 600.0))
        if not auto_start:
            await service.runs.start((await service.until_state(job, "prepared")).run_id or "")
        await service.until(lambda: service.armed() > 1, "it must have tried to arm")
        assert run_of(service, job).state is RunState.STARTING
        yield service, job


@asynccontextmanager
async def told_to_arm() -> AsyncIterator[tuple[JobService, Job]]:
    """A job whose vehicle is armed, and is about to take off."""
    async with job_service() as service:
        service.vehicles[0].start_gate.clear()
        job = await service.order(vehicle="v1", auto_start=True, deadline=at(service, 600.0))
        await service.until(lambda: service.vehicles[0].truth.armed is True, "it must be armed")
        yield service, job


async def assert_it_stays_on_the_ground(service: JobService) -> None:
    """Also when the vehicle could be armed again."""
    tried = service.armed()
    service.vehicles[0].arm_refusals = 0
    await service.some_passes()
    assert (service.armed(), service.vehicles[0].truth.armed) == (tried, False)


@pytest.mark.parametrize("auto_start", [True, False], ids=["by itself", "by a person"])
async def test_a_job_that_is_cancelled_while_its_start_waits_to_arm_does_not_fly(auto_start: bool) -> None:
    async with waits_to_arm(auto_start=auto_start) as (service, job):
        await service.jobs.cancel(job.id, "ann")
        await assert_it_stays_on_the_ground(service)
        ended = await service.until_state(job, "cancelled")
        assert ended.reason == Reason.of(ReasonCode.JOB_CANCELLED, actor="ann")
        assert run_of(service, job).state is RunState.ABORTED
        assert not service.events.queues["v1"].stopped, "cancelling a job stops no queue"


async def test_a_job_whose_deadline_passes_while_its_start_waits_to_arm_does_not_fly() -> None:
    async with waits_to_arm() as (service, job):
        service.clock.ahead_s = 601.0
        await service.until_state(job, "expired")
        await assert_it_stays_on_the_ground(service)
        assert run_of(service, job).state is RunState.ABORTED


async def test_a_queue_that_is_stopped_while_a_start_waits_to_arm_holds_it_back_until_a_person_starts_it() -> None:
    async with waits_to_arm() as (service, job):
        await service.jobs.stop("v1", "ann")
        await assert_it_stays_on_the_ground(service)
        await service.until(lambda: "stopped by ann" in describe(service.job(job).reason), "the reason must be told")
        assert (service.job(job).state, run_of(service, job).state) == (JobState.PREPARED, RunState.UPLOADED)
        await service.jobs.resume("v1", "ann")
        await assert_it_stays_on_the_ground(service)
        await service.runs.start(service.job(job).run_id or "")
        await service.until_state(job, "flying")


async def test_a_queue_that_is_stopped_as_a_start_is_asked_holds_it_back() -> None:
    async with job_service() as service:
        job = await service.until_state(await service.order(vehicle="v1"), "prepared")
        await service.runs.start(job.run_id or "")
        await service.jobs.stop("v1", "ann")
        await assert_it_stays_on_the_ground(service)
        assert run_of(service, job).state is RunState.UPLOADED


async def test_once_its_vehicle_is_told_to_arm_a_job_is_not_cancelled() -> None:
    async with told_to_arm() as (service, job):
        with pytest.raises(JobWrongStateError, match="being started"):
            await service.jobs.cancel(job.id, "ann")
        service.vehicles[0].start_gate.set()
        flying = await service.until_state(job, "flying")
        assert (flying.end_requested, flying.reason) == ("", None)
        with pytest.raises(JobWrongStateError, match="is flying"):
            await service.jobs.cancel(job.id, "ann")
        assert not {"return", "disarm"} & set(service.vehicles[0].sent)
        assert (await service.fly(job)).state is JobState.COMPLETED


async def test_once_its_vehicle_is_told_to_arm_a_deadline_and_a_stopped_queue_do_not_end_the_start() -> None:
    async with told_to_arm() as (service, job):
        service.clock.ahead_s = 601.0
        assert (await service.jobs.stop("v1", "ann")).queue.stopped
        await service.some_passes()
        service.vehicles[0].start_gate.set()
        assert (await service.until_state(job, "flying")).end_requested == ""
        assert not {"return", "disarm"} & set(service.vehicles[0].sent)


async def test_at_whatever_event_a_job_is_cancelled_it_does_not_fly_or_that_is_refused() -> None:
    refused, event = False, 2
    while not refused:
        async with job_service() as service:
            job = await service.order(vehicle="v1", auto_start=True)
            await service.until_events(event)
            try:
                await service.jobs.cancel(job.id, "ann")
            except JobWrongStateError:
                await service.until_state(job, "flying")
                refused = True
            else:
                await service.until_state(job, "cancelled", "flying", "failed")
                assert service.job(job).state is JobState.CANCELLED, f"cancelled at event {event}"
                assert service.armed() == 0, f"cancelled at event {event}"
        event += 1
    assert event > 6, "it must have been cancelled in each step of its preparation"
