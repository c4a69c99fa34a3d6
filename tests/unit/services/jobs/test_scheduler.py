"""The scheduler gives jobs to vehicles, and moves nothing that is not ready, is held by somebody, or came too late."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from app.domain.errors import LinkTimeoutError, VehicleBusyError
from app.domain.jobs.job import Job, JobState
from app.domain.reasons import describe
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import LandedState, VehicleProfile
from tests.support.events import data_of
from tests.support.job_service import PROMPT, JobService, job_service
from tests.support.scheduled_jobs import at, lease
from tests.support.scripted_link import ScriptedVehicle


def changes(service: JobService, job: Job) -> list[str]:
    """What the journal says has happened to a job."""
    told = [data_of(event) for event in service.events.events if event.kind == "job.changed"]
    return [data["change"] for data in told if data["job"]["id"] == job.id]


async def test_a_prepared_job_is_not_started_over_a_lease_or_an_armed_vehicle_and_says_so() -> None:
    async with job_service() as service:
        vehicle = service.vehicles[0]
        vehicle.upload_gate.clear()
        job = await service.order(vehicle="v1", auto_start=True)
        await service.until(lambda: vehicle.waits_at_gate, "the upload begins")
        lease("v1", service, "a pilot")
        vehicle.upload_gate.set()
        await service.until(
            lambda: "a pilot has its offboard lease" in describe(service.job(job).reason), "the reason must be told"
        )
        vehicle.put(armed=True)
        lease("v1", service, None)
        await service.until(lambda: "it is armed" in describe(service.job(job).reason), "the reason must be told")
        assert (service.job(job).state, service.armed()) == (JobState.PREPARED, 0)
        vehicle.put(armed=False, landed=LandedState.ON_GROUND)
        await service.until_state(job, "flying")
        assert service.armed() == 1


async def test_a_start_that_fails_on_the_ground_is_not_tried_again_by_itself() -> None:
    async with job_service() as service:
        service.vehicles[0].arm_refusals = 99
        job = await service.order(vehicle="v1", auto_start=True)
        await service.until(lambda: "arming denied" in describe(service.job(job).reason), "the reason must be told")
        tried = service.armed()
        await service.some_passes()
        assert (service.armed(), service.job(job).state) == (tried, JobState.PREPARED)
        service.vehicles[0].arm_refusals = 0
        await service.runs.start(service.job(job).run_id or "")
        await service.until_state(job, "flying")


async def test_a_deadline_takes_a_prepared_run_off_its_vehicle_and_the_next_job_follows() -> None:
    async with job_service() as service:
        job = await service.order(vehicle="v1", deadline=at(service, 60.0))
        prepared = await service.until_state(job, "prepared")
        following = await service.order(vehicle="v1")
        service.clock.ahead_s = 61.0
        expired = await service.until_state(job, "expired")
        assert "deadline" in describe(expired.reason)
        assert service.events.runs[prepared.run_id or ""].state is RunState.ABORTED
        assert service.armed() == 0
        await service.until_state(following, "prepared")


async def test_a_deadline_ends_a_waiting_job_with_what_spoke_against_each_vehicle() -> None:
    async with job_service(2) as service:
        service.vehicles[0].put(connected=False)
        service.vehicles[1].put(armed=True)
        job = await service.order(deadline=at(service, 60.0))
        service.clock.ahead_s = 61.0
        expired = await service.until_state(job, "expired")
        refused = {one.vehicle_id: [refusal.code for refusal in one.refusals] for one in expired.candidates}
        assert refused == {"v1": ["vehicle.disconnected"], "v2": ["vehicle.armed"]}


@pytest.mark.parametrize("state", ["queued", "prepared"])
async def test_a_clock_that_jumps_past_the_deadline_and_back_ends_no_job(
    monkeypatch: pytest.MonkeyPatch, state: str
) -> None:
    patient(monkeypatch, late_for_s=60.0)
    async with job_service() as service:
        service.vehicles[0].put(connected=state == "prepared")
        job = await service.order(vehicle="v1", deadline=at(service, 600.0))
        await service.until_state(job, state)
        service.clock.ahead_s = 7200.0
        await service.some_passes()
        assert service.job(job).state is JobState(state)
        service.clock.ahead_s = 0.0
        service.vehicles[0].put(connected=True)
        await service.runs.start((await service.until_state(job, "prepared")).run_id or "")
        await service.until_state(job, "flying")


async def test_no_job_is_started_while_the_clock_is_past_its_deadline(monkeypatch: pytest.MonkeyPatch) -> None:
    patient(monkeypatch, late_for_s=60.0)
    async with job_service() as service:
        service.vehicles[0].put(connected=False)
        job = await service.order(vehicle="v1", auto_start=True, deadline=at(service, 600.0))
        service.clock.ahead_s = 601.0
        service.vehicles[0].put(connected=True)
        await service.some_passes()
        assert (service.job(job).state, service.armed()) == (JobState.QUEUED, 0)


async def test_a_deadline_that_passes_in_flight_changes_nothing() -> None:
    async with job_service() as service:
        job = await service.order(vehicle="v1", auto_start=True, deadline=at(service, 60.0))
        await service.until_state(job, "flying")
        service.clock.ahead_s = 61.0
        await service.some_passes()
        assert service.job(job).state is JobState.FLYING
        assert "return" not in service.vehicles[0].sent
        assert (await service.fly(job)).state is JobState.COMPLETED


async def test_two_jobs_for_any_go_to_two_vehicles_and_a_third_waits_for_the_first_that_is_free() -> None:
    async with job_service(2) as service:
        jobs = [await service.order(auto_start=True) for _ in range(3)]
        flying = [await service.until_state(job, "flying") for job in jobs[:2]]
        assert sorted(job.vehicle_id or "" for job in flying) == ["v1", "v2"]
        await service.some_passes()
        assert service.job(jobs[2]).state is JobState.QUEUED
        await service.fly(jobs[1])
        assert (await service.until_state(jobs[2], "flying")).vehicle_id == flying[1].vehicle_id


async def test_a_vehicle_that_is_silent_holds_up_no_other_and_is_asked_on() -> None:
    async with job_service(2) as service:
        silent, asked = service.vehicles[0], asyncio.Event()

        async def read_facts(*, fresh: bool = False) -> VehicleProfile:
            await asked.wait()
            return silent.facts

        silent.read_facts = read_facts  # type: ignore[method-assign]
        job = await service.order()
        given = await service.until_state(job, "prepared")
        assert given.vehicle_id == "v2"
        assert [refusal.code for refusal in given.candidates[0].refusals] == ["vehicle.silent"]
        other = await service.order(vehicle="v1")
        await service.some_passes()
        asked.set()
        await service.until_state(other, "prepared")


async def test_a_vehicle_that_is_taken_at_the_last_moment_gives_the_job_back_to_the_queue(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with job_service() as service:
        create, refusals = service.runs.create, [VehicleBusyError("somebody was faster")]

        async def create_later(*given: Any, **more: Any) -> Run:
            if refusals:
                raise refusals.pop()
            return await create(*given, **more)

        monkeypatch.setattr(service.runs, "create", create_later)
        job = await service.order(vehicle="v1")
        await service.until_state(job, "prepared")
        assert changes(service, job) == ["queued", "assigned", "requeued", "assigned", "prepared"]


async def test_an_upload_that_fails_fails_the_job_and_stops_the_queue() -> None:
    async with job_service() as service:
        service.vehicles[0].upload_error = LinkTimeoutError("the vehicle did not ask for item 2")
        job, following = [await service.order(vehicle="v1") for _ in range(2)]
        failed = await service.until_state(job, "failed")
        assert "did not ask for item 2" in describe(failed.reason)
        assert service.events.queues["v1"].reason == failed.reason
        await service.some_passes()
        assert service.job(following).state is JobState.QUEUED
        service.vehicles[0].upload_error = None
        await service.jobs.resume("v1", "ward 3")
        await service.until_state(following, "prepared")


async def test_a_queue_can_be_resumed_before_anybody_noticed_that_it_should_stand() -> None:
    async with job_service() as service:
        run = await service.runs.create("plan-1", "v1", start=False, actor="desk")
        await service.runs.abort(run.id)
        await service.until(lambda: service.events.runs[run.id].is_over, "the run must end")
        await service.jobs.resume("v1", "ward 3")
        await service.until_state(await service.order(vehicle="v1"), "prepared")


async def test_rules_are_looked_at_with_the_vehicles_own_parameters() -> None:
    async with job_service(2) as service:
        first, _ = service.vehicles
        first.facts = replace(first.facts, max_mission_items=2)
        job = await service.until_state(await service.order(), "prepared")
        assert job.vehicle_id == "v2"
        (refusal,) = job.candidates[0].refusals
        assert (refusal.code.split(".")[0], refusal.pointer is not None) == ("limits", True)


class SlowFacts:
    """A vehicle that reports its facts once `may_answer` is set; with `only_fresh` this is about a start alone."""

    def __init__(self, vehicle: ScriptedVehicle, *, only_fresh: bool = False) -> None:
        self._vehicle = vehicle
        self._only_fresh = only_fresh
        self.may_answer = asyncio.Event()
        vehicle.read_facts = self.read_facts  # type: ignore[method-assign]

    async def read_facts(self, *, fresh: bool = False) -> VehicleProfile:
        if fresh or not self._only_fresh:
            await self.may_answer.wait()
        return self._vehicle.facts


def patient(monkeypatch: pytest.MonkeyPatch, **settings: float) -> None:
    """Queues with more patience: their settings from now on."""
    monkeypatch.setattr("tests.support.job_service.PROMPT", replace(PROMPT, **settings))


async def test_jobs_of_a_silent_vehicle_hold_up_neither_another_job_nor_a_deadline(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    patient(monkeypatch, facts_s=60.0)
    async with job_service(2) as service:
        SlowFacts(service.vehicles[0])
        waiting = [await service.order(vehicle="v1", min_battery_percent=percent) for percent in range(3)]
        late = await service.order(vehicle="v1", deadline=at(service, 60.0))
        other = await service.order(vehicle="v2", auto_start=True)
        await service.until_state(other, "flying")
        service.clock.ahead_s = 61.0
        await service.until_state(late, "expired")
        assert (await service.fly(other)).state is JobState.COMPLETED
        assert {service.job(job).state for job in waiting} == {JobState.QUEUED}


async def test_a_start_that_waits_for_its_vehicle_holds_up_no_other() -> None:
    async with job_service(2) as service:
        slow = SlowFacts(service.vehicles[0], only_fresh=True)
        first = await service.order(vehicle="v1", auto_start=True)
        await service.until(lambda: service.job(first).start_requested_at is not None, "its start must be requested")
        second = await service.order(vehicle="v2", auto_start=True)
        await service.until_state(second, "flying")
        assert service.job(first).state is JobState.PREPARED
        slow.may_answer.set()
        await service.until_state(first, "flying")


async def test_a_vehicle_that_reports_late_gets_its_job_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    patient(monkeypatch, retry_after_s=600.0)
    async with job_service() as service:
        slow = SlowFacts(service.vehicles[0])
        job = await service.order(vehicle="v1")
        await service.some_passes()  # it is refused: it had 0.05 s
        slow.may_answer.set()
        await service.until_state(job, "prepared")


async def test_a_job_for_any_waits_a_moment_for_a_vehicle_whose_facts_are_being_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    patient(monkeypatch, facts_s=60.0)
    async with job_service(2) as service:
        slow = SlowFacts(service.vehicles[0])
        first, later = await service.order(), await service.order(vehicle="v2", priority=-1)
        await service.some_passes()
        assert {service.job(job).state for job in (first, later)} == {JobState.QUEUED}, "v2 is kept for the first one"
        slow.may_answer.set()
        assert (await service.until_state(first, "prepared")).vehicle_id == "v1"
        await service.until_state(later, "prepared")
