"""Between a look at a run and the action that follows lies time: what happens in it still counts."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest

from app.domain.errors import WrongStateError
from app.domain.events import NewEvent
from app.domain.jobs.job import Job, JobState
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import VehicleProfile
from tests.support.job_service import JobService, job_service
from tests.support.scheduled_jobs import at, lease
from tests.support.scripted_link import ScriptedVehicle


class HeldFacts:
    """From `hold` on the vehicle's facts come only when they are let go."""

    def __init__(self, vehicle: ScriptedVehicle) -> None:
        self._vehicle = vehicle
        self._read = self._vehicle.read_facts
        self._gate = asyncio.Event()
        self.asked = False

    def hold(self) -> None:
        self._vehicle.read_facts = self._later  # type: ignore[method-assign]

    def let_go(self) -> None:
        self._gate.set()

    async def _later(self, *, fresh: bool = False) -> VehicleProfile:
        self.asked = True
        await self._gate.wait()
        return await self._read()


@asynccontextmanager
async def about_to_start() -> AsyncIterator[tuple[JobService, Job, HeldFacts]]:
    """A job whose start is asked, and the vehicle's facts are read for the last check."""
    async with job_service(2) as service:
        vehicle = service.vehicles[0]
        facts = HeldFacts(vehicle)
        vehicle.upload_gate.clear()
        job = await service.order(vehicle="v1", auto_start=True, deadline=at(service, 600.0))
        await service.until(lambda: vehicle.waits_at_gate, "the upload begins, for which the facts are read as well")
        facts.hold()
        vehicle.upload_gate.set()
        await service.until(
            lambda: facts.asked and service.job(job).start_requested_at is not None, "a start is requested"
        )
        yield service, job, facts


async def test_a_job_that_is_cancelled_while_its_start_is_checked_does_not_start() -> None:
    async with about_to_start() as (service, job, facts):
        await service.jobs.cancel(job.id, "ann")
        HeldFacts(service.vehicles[1]).hold()
        await service.order(vehicle="v2")  # keeps the scheduler from noticing the cancelling at once
        facts.let_go()
        ended = await service.until_state(job, "cancelled", "flying")
        assert (ended.state, ended.reason) == (JobState.CANCELLED, Reason.of(ReasonCode.JOB_CANCELLED, actor="ann"))
        assert service.armed() == 0
        assert service.events.runs[ended.run_id or ""].state is RunState.ABORTED


async def test_a_job_whose_deadline_passes_while_its_start_is_checked_does_not_start() -> None:
    async with about_to_start() as (service, job, facts):
        service.clock.ahead_s = 601.0
        facts.let_go()
        assert (await service.until_state(job, "expired", "flying")).state is JobState.EXPIRED
        assert service.armed() == 0


async def _stop_queue(service: JobService) -> None:
    await service.jobs.stop("v1", "ann")


async def _go_on(service: JobService) -> None:
    await service.jobs.resume("v1", "ann")


async def _take_lease(service: JobService) -> None:
    lease("v1", service, "a pilot")


async def _give_lease_back(service: JobService) -> None:
    lease("v1", service, None)


async def _arm(service: JobService) -> None:
    service.vehicles[0].put(armed=True)


async def _disarm(service: JobService) -> None:
    service.vehicles[0].put(armed=False)


Step = Callable[[JobService], Awaitable[None]]


@pytest.mark.parametrize(
    ("happens", "told", "is_over"),
    [
        pytest.param(_stop_queue, "its queue is stopped", _go_on, id="queue stopped"),
        pytest.param(_take_lease, "a pilot has its offboard lease", _give_lease_back, id="lease"),
        pytest.param(_arm, "it is armed", _disarm, id="armed"),
    ],
)
async def test_what_forbids_a_start_while_it_is_checked_holds_it_back_until_that_is_over(
    happens: Step, told: str, is_over: Step
) -> None:
    async with about_to_start() as (service, job, facts):
        await happens(service)
        facts.let_go()
        await service.until(
            lambda: told in describe(service.job(job).reason) or service.armed() > 0, "the reason must be told"
        )
        assert (service.job(job).state, service.armed()) == (JobState.PREPARED, 0)
        await is_over(service)
        await service.until_state(job, "flying")
        assert service.armed() == 1


async def test_a_run_cannot_be_started_while_its_end_is_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    async with job_service() as service:
        job = await service.order(vehicle="v1", deadline=at(service, 600.0))
        prepared = await service.until_state(job, "prepared")
        record, storing, stored = service.journal.record, asyncio.Event(), asyncio.Event()

        async def record_later(*events: NewEvent, **more: Any) -> None:
            if any(isinstance(one, Job) and one.end_requested for one in more.get("jobs", ())):
                storing.set()
                await stored.wait()
            await record(*events, **more)

        monkeypatch.setattr(service.journal, "record", record_later)
        service.clock.ahead_s = 601.0
        await service.until(storing.is_set, "the end must be asked")
        with pytest.raises(WrongStateError):
            await service.runs.start(prepared.run_id or "")
        stored.set()
        await service.until_state(job, "expired")
        assert service.armed() == 0
