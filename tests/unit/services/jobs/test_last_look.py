"""Between a look at a run and the deed that follows lies time: what happens in it still counts."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest

from app.domain.events import NewEvent
from app.domain.jobs.job import Job, JobState
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import VehicleProfile
from tests.support.job_fleet import Yard, a_yard
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
async def about_to_start() -> AsyncIterator[tuple[Yard, Job, HeldFacts]]:
    """A job whose start is asked, and the vehicle's facts are read for the last check."""
    async with a_yard(2) as yard:
        vehicle = yard.vehicles[0]
        facts = HeldFacts(vehicle)
        vehicle.upload_gate.clear()
        job = await yard.order(vehicle="v1", auto_start=True, deadline=at(yard, 600.0))
        await yard.until(lambda: vehicle.waits_at_gate, "the upload begins, for which the facts are read as well")
        facts.hold()
        vehicle.upload_gate.set()
        await yard.until(lambda: facts.asked and yard.job(job).start_requested_at is not None, "a start is requested")
        yield yard, job, facts


async def test_a_job_that_is_cancelled_while_its_start_is_checked_does_not_start() -> None:
    async with about_to_start() as (yard, job, facts):
        await yard.jobs.cancel(job.id, "ann")
        HeldFacts(yard.vehicles[1]).hold()
        await yard.order(vehicle="v2")  # keeps the desk from noticing the cancelling at once
        facts.let_go()
        ended = await yard.until_state(job, "cancelled", "flying")
        assert (ended.state, ended.reason) == (JobState.CANCELLED, Reason.of(ReasonCode.JOB_CANCELLED, actor="ann"))
        assert yard.armed() == 0
        assert yard.events.runs[ended.run_id or ""].state is RunState.ABORTED


async def test_a_job_whose_deadline_passes_while_its_start_is_checked_does_not_start() -> None:
    async with about_to_start() as (yard, job, facts):
        yard.clock.ahead_s = 601.0
        facts.let_go()
        assert (await yard.until_state(job, "expired", "flying")).state is JobState.EXPIRED
        assert yard.armed() == 0


async def _stop_queue(yard: Yard) -> None:
    await yard.jobs.stop("v1", "ann")


async def _go_on(yard: Yard) -> None:
    await yard.jobs.resume("v1", "ann")


async def _take_lease(yard: Yard) -> None:
    lease("v1", yard, "a pilot")


async def _give_lease_back(yard: Yard) -> None:
    lease("v1", yard, None)


async def _arm(yard: Yard) -> None:
    yard.vehicles[0].put(armed=True)


async def _disarm(yard: Yard) -> None:
    yard.vehicles[0].put(armed=False)


Deed = Callable[[Yard], Awaitable[None]]


@pytest.mark.parametrize(
    ("happens", "told", "is_over"),
    [
        pytest.param(_stop_queue, "its queue is stopped", _go_on, id="queue stopped"),
        pytest.param(_take_lease, "a pilot has its offboard lease", _give_lease_back, id="lease"),
        pytest.param(_arm, "it is armed", _disarm, id="armed"),
    ],
)
async def test_what_forbids_a_start_while_it_is_checked_holds_it_back_until_that_is_over(
    happens: Deed, told: str, is_over: Deed
) -> None:
    async with about_to_start() as (yard, job, facts):
        await happens(yard)
        facts.let_go()
        await yard.until(lambda: told in describe(yard.job(job).reason) or yard.armed() > 0, "the reason must be told")
        assert (yard.job(job).state, yard.armed()) == (JobState.PREPARED, 0)
        await is_over(yard)
        await yard.until_state(job, "flying")
        assert yard.armed() == 1


async def test_a_run_that_a_person_starts_while_its_end_is_stored_is_not_brought_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with a_yard() as yard:
        job = await yard.order(vehicle="v1", deadline=at(yard, 600.0))
        prepared = await yard.until_state(job, "prepared")
        record, storing, stored = yard.journal.record, asyncio.Event(), asyncio.Event()

        async def record_later(*events: NewEvent, **more: Any) -> None:
            if any(isinstance(one, Job) and one.end_requested for one in more.get("jobs", ())):
                storing.set()
                await stored.wait()
            await record(*events, **more)

        monkeypatch.setattr(yard.journal, "record", record_later)
        yard.clock.ahead_s = 601.0
        await yard.until(storing.is_set, "the end must be asked")
        await yard.runs.start(prepared.run_id or "")
        await yard.until(lambda: yard.events.runs[prepared.run_id or ""].state is RunState.FLYING, "it must fly")
        stored.set()
        flying = await yard.until_state(job, "flying")
        assert "started before" in describe(flying.reason)
        assert not {"return", "disarm"} & set(yard.vehicles[0].sent)
        assert (await yard.fly(job)).state is JobState.COMPLETED
