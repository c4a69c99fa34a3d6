"""Whatever kills Waydrop, and when: no job is lost, and none is started twice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from app.domain.errors import NotFoundError, StorageError
from app.domain.jobs.job import Job, JobState
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import RunState
from app.services.jobs.views import JobUpdate
from tests.support.job_service import JobService, job_service
from tests.support.scheduled_jobs import at
from tests.support.scripted_link import FAST

STOPPED = Reason.of(ReasonCode.QUEUE_STOPPED, actor="ward 3")
BROKEN_OFF = Reason.of(ReasonCode.RESTART_BEFORE_UPLOAD_ENDED)


async def _events_until_it_flies() -> int:
    async with job_service() as service:
        job = await service.order(vehicle="v1", auto_start=True)
        await service.until_state(job, "flying")
        return len(service.events.events)


def _has_settled(service: JobService, job: Job) -> Callable[[], bool]:
    """It flies, is over, or waits for a person, and says so."""

    def settled() -> bool:
        now = service.job(job)
        waits = now.state is JobState.PREPARED and now.start_requested_at is not None and now.reason is not None
        return waits or now.is_over or now.state is JobState.FLYING

    return settled


async def test_killed_after_any_event_a_job_is_not_lost_and_not_started_twice() -> None:
    for event in range(2, await _events_until_it_flies() + 1):
        async with job_service() as service:
            await service.until_events(1)
            service.die_at(event)
            try:
                job = await service.order(vehicle="v1", auto_start=True)
            except StorageError:
                continue  # who ordered it was told that it is not stored
            await service.until_events(event)
            await service.some_passes()
            asked = service.job(job).start_requested_at
            service.revive()
            await service.restart()
            await service.until(_has_settled(service, job), f"killed at event {event} it must settle")
            await service.some_passes()
            assert service.armed() <= 1, f"killed at event {event}: armed twice"
            runs = [run for run in service.events.runs.values() if run.reason != BROKEN_OFF]
            assert len(runs) == 1, "one job is one run, but for what a restart broke off on the ground"
            if asked is not None:
                assert service.job(job).start_requested_at == asked, "a start is asked once"


async def test_after_a_restart_a_start_that_was_asked_is_left_to_a_person() -> None:
    async with job_service() as service:
        dead = StorageError("killed")
        job = await service.order(vehicle="v1", auto_start=True)
        service.events.refuse = lambda event: dead if service.job(job).start_requested_at is not None else None
        await service.until(lambda: service.job(job).start_requested_at is not None, "a start must be asked")
        await service.some_passes()
        assert service.armed() == 0, "what is not stored is not done"
        service.revive()
        await service.restart()
        await service.until(
            lambda: "an operator may start it" in describe(service.job(job).reason), "the reason must be told"
        )
        await service.some_passes()
        assert (service.job(job).state, service.armed()) == (JobState.PREPARED, 0)
        run_id = service.job(job).run_id or ""
        await service.until(lambda: service.fleet.view("v1").run_id == run_id, "the run must be taken up")
        await service.runs.start(run_id)
        await service.until_state(job, "flying")
        assert (await service.fly(job)).state is JobState.COMPLETED


async def test_a_job_that_was_prepared_and_not_yet_started_goes_on_after_a_restart() -> None:
    async with job_service() as service:
        job = await service.order(vehicle="v1")
        prepared = await service.until_state(job, "prepared")
        await service.restart()
        await service.some_passes()
        assert service.job(job) == prepared, "nobody started it"
        await service.until(lambda: service.fleet.view("v1").run_id == prepared.run_id, "the run must be taken up")
        await service.runs.start(prepared.run_id or "")
        await service.until_state(job, "flying")


@pytest.mark.parametrize("auto_start", [True, False], ids=["by itself", "by a person"])
async def test_a_start_that_a_restart_interrupted_waits_for_a_person(auto_start: bool) -> None:
    async with job_service(settings=replace(FAST, armable_s=60.0)) as service:
        service.vehicles[0].arm_refusals = 1_000_000
        job = await service.order(vehicle="v1", auto_start=auto_start)
        if not auto_start:
            await service.runs.start((await service.until_state(job, "prepared")).run_id or "")
        await service.until(lambda: service.armed() > 0, "it must have tried to arm")
        await service.restart()
        tried = service.armed()
        service.vehicles[0].arm_refusals = 0
        run_id = service.job(job).run_id or ""
        await service.until(lambda: service.events.runs[run_id].state is not RunState.STARTING, "it must be found")
        await service.some_passes()
        waits = service.job(job)
        assert (waits.state, service.armed()) == (JobState.PREPARED, tried)
        code = ReasonCode.JOB_START_UNKNOWN if auto_start else ReasonCode.JOB_WAITS_FOR_START
        assert waits.reason == Reason.of(code)
        assert not service.events.queues
        await service.runs.start(run_id)
        await service.until_state(job, "flying")
        assert (await service.fly(job)).state is JobState.COMPLETED


IMPATIENT = replace(FAST, lost_after_s=0.05)


@pytest.mark.parametrize("end", ["", "cancelled", "expired"])
async def test_a_prepared_job_keeps_waiting_for_a_vehicle_that_is_off_until_it_is_to_end(end: str) -> None:
    async with job_service(settings=IMPATIENT) as service:
        job = await service.order(vehicle="v1", deadline=at(service, 600.0))
        prepared = await service.until_state(job, "prepared")
        service.vehicles[0].put(connected=False)
        await service.restart()
        lost_at_s = service.clock.monotonic() + IMPATIENT.lost_after_s
        await service.until(lambda: service.clock.monotonic() > lost_at_s, "the time to be lost must pass")
        await service.some_passes()
        assert service.job(job) == prepared
        if end == "cancelled":
            await service.jobs.cancel(job.id, "desk")
        elif end == "expired":
            service.clock.ahead_s = 601.0
        if end:
            await service.until_state(job, end, "failed")
            assert service.job(job).state is JobState(end)
            assert service.events.runs[prepared.run_id or ""].state is RunState.ABORTED
            assert not service.events.queues["v1"].stopped
        service.vehicles[0].put(connected=True)
        if not end:
            await service.until(lambda: service.fleet.view("v1").run_id == prepared.run_id, "it must be taken up")
            await service.runs.start(prepared.run_id or "")
            await service.until_state(job, "flying")
        await service.some_passes()
        assert service.armed() == (0 if end else 1)


async def test_a_job_that_is_cancelled_before_its_vehicle_is_found_again_does_not_start() -> None:
    async with job_service() as service:
        job = await service.order(vehicle="v1")
        await service.until_state(job, "prepared")
        await service.restart()
        await service.jobs.cancel(job.id, "desk")
        await service.until_state(job, "cancelled")
        await service.until_state(await service.order(vehicle="v1"), "prepared")


async def test_a_preparation_that_a_restart_broke_off_is_made_again_with_another_run() -> None:
    async with job_service() as service:
        service.vehicles[0].upload_gate.clear()
        job = await service.order(vehicle="v1")
        before = await service.until_state(job, "preparing")
        await service.until(lambda: bool(service.events.runs), "its run must be made")
        await service.end()
        service.vehicles[0].upload_gate.set()
        await service.begin()
        after = await service.until_state(job, "prepared")
        assert after.run_id != before.run_id
        assert service.events.runs[before.run_id or ""].state is RunState.FAILED
        assert not service.events.queues, "no vehicle's queue is stopped by that"


async def test_the_order_and_a_stopped_queue_survive() -> None:
    async with job_service() as service:
        await service.jobs.stop("v1", "ward 3")
        made = [await service.order(vehicle="v1", priority=priority) for priority in (0, 5, 0)]
        await service.restart()
        view = await service.jobs.queues()
        assert [job.id for job in view.waiting] == [made[1].id, made[0].id, made[2].id]
        assert (view.vehicles[0].queue.stopped, view.vehicles[0].queue.reason) == (
            True,
            Reason.of(ReasonCode.QUEUE_STOPPED, actor="ward 3"),
        )
        later = await service.order(vehicle="v1")
        assert (await service.jobs.queues()).waiting[-1].id == later.id, "who comes after a restart comes last"


async def test_moves_that_use_up_the_numbers_between_two_jobs_survive_a_restart() -> None:
    async with job_service() as service:
        await service.jobs.stop("v1", "desk")
        first, second, last = [(await service.order(vehicle="v1")).id for _ in range(3)]
        for _ in range(30):
            for job_id in (first, second):
                await service.jobs.move(job_id, JobUpdate(before=last), "desk")
        await service.restart()
        assert [job.id for job in (await service.jobs.queues()).waiting] == [first, second, last]
        ranks = [service.events.jobs[job_id].rank for job_id in (first, second, last)]
        assert ranks == sorted(set(ranks)), "each has a rank of its own"


async def test_the_queue_of_a_vehicle_that_is_off_is_stopped_before_it_is_switched_on() -> None:
    async with job_service() as service:
        job = await service.order(vehicle="v1", auto_start=True, not_before=at(service, 600.0))
        await service.restart(hears_vehicles=False)
        listed = (await service.jobs.queues()).vehicles
        assert [(one.queue.vehicle_id, one.ready, one.waiting) for one in listed] == [("v1", False, (job.id,))]
        stopped = await service.jobs.stop("v1", "ward 3")
        assert [one.code for one in stopped.refusals] == ["vehicle.unknown", "vehicle.queue_stopped"]
        service.clock.ahead_s = 601.0
        service.switch_on()
        await service.some_passes()
        assert (service.job(job).state, service.armed()) == (JobState.QUEUED, 0)
        await service.jobs.resume("v1", "anna")
        await service.until_state(job, "flying")


async def test_a_stopped_queue_is_listed_and_resumed_while_its_vehicle_is_off() -> None:
    async with job_service() as service:
        await service.jobs.stop("v1", "ward 3")
        await service.restart(hears_vehicles=False)
        assert [one.queue.stopped for one in (await service.jobs.queues()).vehicles] == [True]
        assert (await service.jobs.resume("v1", "anna")).queue.stopped is False
        assert (await service.jobs.queues()).vehicles == ()


@pytest.mark.parametrize("fields", [{"vehicle": "v1"}, {"allowed_vehicles": ["v1"]}], ids=["named", "allowed"])
async def test_a_job_is_accepted_for_a_vehicle_that_is_off_and_flew_before(fields: dict[str, object]) -> None:
    async with job_service() as service:
        flown = await service.order(vehicle="v1", auto_start=True)
        await service.until_state(flown, "flying")
        assert (await service.fly(flown)).state is JobState.COMPLETED
        await service.restart(hears_vehicles=False)
        job = await service.order(**fields)
        assert [refusal.code for one in job.candidates for refusal in one.refusals] == ["vehicle.unknown"]
        service.switch_on()
        await service.until_state(job, "prepared")


async def test_a_vehicle_of_which_nothing_is_stored_has_no_queue() -> None:
    async with job_service() as service:
        await service.order(vehicle="v1")
        await service.restart(hears_vehicles=False)
        for change in (service.jobs.stop("v9", "desk"), service.jobs.resume("v9", "desk"), service.order(vehicle="v9")):
            with pytest.raises(NotFoundError):
                await change
