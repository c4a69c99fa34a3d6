"""A job that several sites may fly is flown by one of them, whatever is lost between the node and the gateways."""

from __future__ import annotations

import asyncio
import itertools
import random
import time
from collections.abc import Callable
from datetime import UTC, datetime

import pytest

from app.domain.cluster.ports import calls_of
from app.domain.errors import ConflictError, JobNotTakenError, JobWrongStateError, StorageError
from app.domain.events import NewEvent
from app.domain.events.service import JobChanged
from app.domain.jobs.job import TAKEN_WITHIN_S, Candidate, Job, JobClaim, JobState
from app.domain.reasons import ReasonCode
from app.services.jobs.views import JobUpdate
from app.services.remote.shared_jobs import CLEARED_AFTER_S
from tests.support.job_examples import a_job
from tests.support.job_service import job_service
from tests.support.scheduled_jobs import IN_YEARS
from tests.support.shared_jobs import SITES, Sites, two_sites

SOME_LOOKS = 40
CLAIM = JobClaim(site="north", gateway="gw-north")


async def looks(sites: Sites) -> None:
    """What must not happen has its chance to."""
    assert sites.node is not None
    for _ in range(SOME_LOOKS):
        await sites.node.poll()
        await asyncio.sleep(0.005)


def flies(sites: Sites, job: Job) -> Callable[[], bool]:
    return lambda: sites.job(job).state is JobState.FLYING


async def test_the_best_vehicle_of_all_sites_flies_it_and_no_other() -> None:
    async with two_sites() as sites:
        sites.services["north"].vehicles[0].put(battery_percent=60.0)
        job = await sites.order()
        assert (job.fence, job.claim) == (1, None)
        await sites.until(flies(sites, job), "it must fly")
        await looks(sites)
        flying = sites.job(job)
        assert flying.claim is not None
        assert (flying.claim.site, flying.claim.gateway, flying.claim.taken) == ("south", "gw-south", True)
        assert [one.reason and one.reason.code for one in flying.candidates] == [ReasonCode.CHOSEN]
        assert flying.vehicle_id == "south-v1"
        assert sites.armed() == {"north": 0, "south": 1}


async def test_the_queue_has_one_order_for_all_sites() -> None:
    async with two_sites() as sites:
        assert sites.node is not None
        first, second = [await sites.order(not_before=IN_YEARS) for _ in range(2)]
        moved = await sites.node.move(second.id, JobUpdate(before=first.id), "desk")
        assert sites.job(second).place < sites.job(first).place
        assert moved.fence > second.fence, "each change of the cluster raises the fencing number"
        assert (await sites.node.cancel(first.id, "desk")).state is JobState.CANCELLED


async def test_one_that_is_too_late_expires_and_says_why_no_vehicle_could_fly_it() -> None:
    async with two_sites() as sites:
        for service in sites.services.values():
            service.vehicles[0].put(connected=False)
        job = await sites.order(deadline=datetime.fromtimestamp(time.time() + 60.0, UTC).isoformat())
        await looks(sites)
        assert sites.job(job).state is JobState.QUEUED
        sites.pass_time(61.0)
        await sites.until(lambda: sites.job(job).state is JobState.EXPIRED, "it must expire")
        assert [one.vehicle_id for one in sites.job(job).candidates] == ["north-v1", "south-v1"]


@pytest.mark.parametrize("what", ["request", "answer"])
async def test_what_is_lost_on_the_way_is_asked_and_flown_once(what: str) -> None:
    async with two_sites() as sites:
        lost = iter([False, True])  # the assessment, then the order to take it

        def loses(subject: str) -> bool:
            return subject == calls_of("north") and next(lost, False)

        sites.services["south"].vehicles[0].put(connected=False)
        setattr(sites.bus, f"loses_{what}", loses)
        job = await sites.order()
        await sites.until(flies(sites, job), "it must fly")
        await sites.bus.deliver_late()
        await looks(sites)
        assert sites.armed() == {"north": 1, "south": 0}
        runs = [run for run in sites.services["north"].events.runs.values() if run.started_at is not None]
        assert len(runs) == 1


async def test_a_claim_that_is_not_answered_goes_to_nobody_else_until_a_person_clears_it() -> None:
    async with two_sites() as sites:
        assert sites.node is not None
        sites.services["south"].vehicles[0].put(battery_percent=10.0)
        job = await sites.order(min_battery_percent=50)
        await _given_and_cut_off(sites, job)
        sites.services["south"].vehicles[0].put(battery_percent=99.0)
        await looks(sites)
        waits = sites.job(job)
        assert (waits.state, waits.claim is not None and waits.claim.taken) == (JobState.PREPARING, False)
        assert sites.armed() == {"north": 0, "south": 0}
        with pytest.raises(JobWrongStateError, match="may still get"):
            await sites.node.clear_claim(job.id, "anna")
        sites.pass_time(CLEARED_AFTER_S)
        cleared = await sites.node.clear_claim(job.id, "anna")
        assert cleared.reason is not None
        assert cleared.reason.code is ReasonCode.JOB_CLAIM_CLEARED
        sites.services["north"].vehicles[0].put(connected=False)
        await sites.until(flies(sites, job), "the other site must fly it")
        assert sites.armed()["south"] == 1


async def _given_and_cut_off(sites: Sites, job: Job) -> None:
    """The north is asked, is given the job, and cut off before it hears of that."""
    asked = itertools.count()
    sites.bus.loses_request = lambda subject: subject == calls_of("north") and next(asked) > 0
    await sites.until(lambda: sites.job(job).claim is not None, "the north must be named")
    sites.store.cut_off.add("north")


async def test_a_claim_that_its_gateway_answers_is_not_cleared() -> None:
    async with two_sites() as sites:
        assert sites.node is not None
        job = await sites.order(auto_start=False)
        await sites.until(lambda: sites.job(job).state is JobState.PREPARED, "it must wait for its start")
        with pytest.raises(JobWrongStateError, match="answers that it has job"):
            await sites.node.clear_claim(job.id, "anna")


@pytest.mark.parametrize("gateway_behind_s", [0.0, 4.0])
async def test_an_order_that_arrives_after_the_claim_was_cleared_is_not_flown(gateway_behind_s: float) -> None:
    """A network that was cut delivers it: the other site flies the job by then."""
    async with two_sites() as sites:
        assert sites.node is not None
        sites.services["south"].vehicles[0].put(battery_percent=10.0)
        job = await sites.order(min_battery_percent=50)
        await _given_and_cut_off(sites, job)
        order = sites.bus.late[0]
        sites.bus.late.clear()  # the questions about it do not arrive
        sites.pass_time(CLEARED_AFTER_S)
        sites.services["north"].clock.ahead_s -= gateway_behind_s
        sites.services["south"].vehicles[0].put(battery_percent=99.0)
        await sites.node.clear_claim(job.id, "anna")
        await sites.until(flies(sites, job), "the other site must fly it")
        sites.bus.late = [order]
        sites.bus.loses_request = lambda subject: False
        await sites.bus.deliver_late()
        sites.store.cut_off.clear()
        await looks(sites)
        assert sites.armed() == {"north": 0, "south": 1}


async def test_a_gateway_takes_no_job_that_was_given_to_it_long_ago() -> None:
    """Its order has a new time if the node stood still before it sent it; the job says when it was given."""
    async with job_service(1, site="north") as service:
        order = a_job(fence=2).given(CLAIM, "run-1", (Candidate(vehicle_id="north-v1", chosen=True),), now=0.0)
        given = order.changed(now=service.clock.now() - TAKEN_WITHIN_S - 1.0)
        with pytest.raises(JobNotTakenError, match=r"(1[6-9]|[2-9]\d) s ago"):
            await service.jobs.take(given)
        assert (await service.jobs.take(given.changed(now=service.clock.now()))).claim is not None


@pytest.mark.parametrize("end", ["cancelled", "expired"])
async def test_a_job_that_was_to_end_at_its_gateway_ends_when_its_claim_is_cleared(end: str) -> None:
    """The gateway is cut off before it has taken the run off its vehicle."""
    async with two_sites() as sites:
        assert sites.node is not None
        sites.services["south"].vehicles[0].put(connected=False)
        north = sites.services["north"]
        north.vehicles[0].upload_gate.clear()
        deadline = datetime.fromtimestamp(time.time() + 600.0, UTC).isoformat()
        job = await sites.order(deadline=deadline)
        await sites.until(lambda: north.vehicles[0].waits_at_gate, "the north must have taken it")
        north.events.refuse = lambda event: None if _is(event, "end_requested") else StorageError("killed")
        if end == "cancelled":
            await north.jobs.cancel(job.id, "anna")
        else:
            sites.pass_time(601.0)
        await sites.until(lambda: sites.job(job).end_requested == end, "its end must be requested")
        sites.store.cut_off.add("north")
        sites.bus.loses_request = lambda subject: subject == calls_of("north")
        sites.services["south"].vehicles[0].put(connected=True)
        sites.pass_time(CLEARED_AFTER_S)
        cleared = await sites.node.clear_claim(job.id, "bob")
        assert (cleared.state, cleared.claim, cleared.end_requested) == (JobState(end), None, "")
        assert cleared.ended_at is not None
        assert cleared.reason is not None
        assert cleared.reason.code is (ReasonCode.JOB_CANCELLED if end == "cancelled" else ReasonCode.JOB_EXPIRED)
        await looks(sites)
        assert sites.armed() == {"north": 0, "south": 0}


async def test_another_node_goes_on_after_one_that_died_between_naming_and_telling() -> None:
    async with two_sites() as sites:
        sites.services["south"].vehicles[0].put(connected=False)
        job = await sites.order()
        await _given_and_cut_off(sites, job)
        sites.bus.loses_request = lambda subject: False
        sites.store.cut_off.clear()
        await sites.lead()
        await sites.until(flies(sites, job), "the new node must ask, and give it again")
        await sites.bus.deliver_late()
        await looks(sites)
        assert sites.armed() == {"north": 1, "south": 0}
        came = [one.data for one in sites.services["north"].events.events if isinstance(one.data, JobChanged)]
        assert [one.change for one in came][:2] == ["returned", "taken"]


async def test_a_gateway_that_restarts_before_the_run_gives_the_job_back() -> None:
    async with two_sites() as sites:
        sites.services["south"].vehicles[0].put(connected=False)
        north = sites.services["north"]
        north.events.refuse = lambda event: None if _is(event, "taken") else StorageError("killed")
        job = await sites.order()
        await sites.until(lambda: _is_taken(sites.job(job)), "it must be taken")
        north.revive()
        await sites.restart("north")
        await sites.until(flies(sites, job), "it must fly in the end")
        await looks(sites)
        assert sites.armed()["north"] == 1


async def test_of_two_people_who_clear_a_claim_one_learns_that_it_was_cleared() -> None:
    async with two_sites() as sites:
        assert sites.node is not None
        sites.services["south"].vehicles[0].put(connected=False)
        job = await sites.order(auto_start=False)
        await _given_and_cut_off(sites, job)
        sites.pass_time(CLEARED_AFTER_S)
        clears = [sites.node.clear_claim(job.id, actor) for actor in ("anna", "bob")]
        results = await asyncio.gather(*clears, return_exceptions=True)
        assert sorted(isinstance(result, ConflictError) for result in results) == [False, True]
        assert sites.job(job).fence == 3, "given is 2, cleared is 3"


async def test_a_gateway_that_has_had_a_job_does_not_take_it_again_after_its_claim_was_cleared() -> None:
    async with job_service(2, site="north") as service:
        now = service.clock.now()
        first = a_job(fence=2).given(CLAIM, "run-1", (Candidate(vehicle_id="north-v1", chosen=True),), now=now)
        again = a_job(fence=4).given(CLAIM, "run-2", (Candidate(vehicle_id="north-v2", chosen=True),), now=now)
        await service.jobs.take(first)
        await service.until_state(first, "prepared")
        for asked in (service.jobs.take, service.jobs.claim_of):
            with pytest.raises(JobNotTakenError, match="had job job-1 before"):
                await asked(again)
        assert service.job(first).run_id == "run-1", "its own record stays, so that a person can cancel it here"
        await service.jobs.cancel(first.id, "anna")
        await service.until_state(first, "cancelled")
        assert (await service.jobs.take(again)).vehicle_id == "north-v2", "nobody has flown it"


async def test_a_job_is_cancelled_while_it_waits_and_not_while_it_is_given() -> None:
    async with two_sites() as sites:
        assert sites.node is not None
        sites.services["south"].vehicles[0].put(connected=False)
        job = await sites.order(auto_start=False)
        sites.own.pause()
        looking = asyncio.create_task(sites.node.poll())
        await sites.services["north"].until(lambda: sites.own.held == 1, "it is being given")
        cancelling = asyncio.create_task(sites.node.cancel(job.id, "anna"))
        await asyncio.sleep(0.05)
        sites.own.open.set()
        await looking
        with pytest.raises(JobWrongStateError, match="given to a gateway"):
            await cancelling
        assert sites.job(job).end_requested == ""


async def test_a_site_that_cannot_say_or_take_holds_up_no_other_site() -> None:
    async with two_sites() as sites:
        assert sites.node is not None
        north = sites.services["north"]
        north.events.refuse = lambda event: StorageError("the disk is full")
        sites.services["south"].vehicles[0].put(battery_percent=60.0)
        first = await sites.order()
        await sites.until(lambda: sites.job(first).claim is not None, "the north looks better")
        second = await sites.order()
        await sites.until(flies(sites, second), "the south must fly the other one")
        assert sites.job(second).vehicle_id == "south-v1"
        with pytest.raises(JobWrongStateError):
            await sites.node.cancel(first.id, "anna")
        sites.pass_time(CLEARED_AFTER_S)
        assert (await sites.node.clear_claim(first.id, "anna")).state is JobState.QUEUED


async def test_what_a_gateway_gave_back_to_a_store_that_was_restored_waits_for_a_person() -> None:
    async with two_sites() as sites:
        assert sites.node is not None
        sites.store.is_restored = True
        sites.services["south"].vehicles[0].put(connected=False)
        north = sites.services["north"]
        north.events.refuse = lambda event: None if isinstance(event.data, JobChanged) else StorageError("full")
        job = await sites.order()
        await sites.until(lambda: sites.job(job).state is JobState.RETURNED, "its run cannot be made")
        with pytest.raises(JobWrongStateError, match="gave job"):
            await sites.node.cancel(job.id, "anna")
        north.revive()
        assert (await sites.node.clear_claim(job.id, "anna")).state is JobState.QUEUED
        await sites.until(flies(sites, job), "it must fly")


async def test_a_vehicle_that_no_gateway_has_reported_holds_up_no_job() -> None:
    async with two_sites() as sites:
        job = await sites.order(allowed_vehicles=["north-v9", "south-v1"])
        await sites.until(flies(sites, job), "the vehicle that is there must fly it")


def _is(event: NewEvent, change: str) -> bool:
    return isinstance(event.data, JobChanged) and event.data.change == change


def _is_taken(job: Job) -> bool:
    return job.claim is not None and job.claim.taken


@pytest.mark.parametrize("seed", range(12))
async def test_whatever_is_lost_and_whoever_dies_no_job_flies_twice_and_none_is_lost(seed: int) -> None:
    chance = random.Random(seed)
    async with two_sites() as sites:
        assert sites.node is not None
        sites.bus.loses_request = lambda subject: chance.random() < 0.25
        sites.bus.loses_answer = lambda subject: chance.random() < 0.25
        jobs = [await sites.order() for _ in range(2)]
        for _ in range(30):
            await sites.node.poll()
            await asyncio.sleep(0.004)
            match chance.randrange(12):
                case 0:
                    await sites.lead()
                case 1:
                    await sites.restart(chance.choice(SITES))
                case 2:
                    await sites.bus.deliver_late()
                case 3:
                    sites.store.cut_off ^= {chance.choice(SITES)}
        sites.bus.loses_request = sites.bus.loses_answer = lambda subject: False
        sites.store.cut_off.clear()
        await sites.bus.deliver_late()
        await sites.until(
            lambda: all(_settled(sites.job(job)) for job in jobs), "each job must fly, or wait for a person"
        )
        await looks(sites)
        for job in jobs:
            started = [
                run.id
                for service in sites.services.values()
                for run in service.events.runs.values()
                if run.started_at is not None and run.id in _runs_of(sites, job)
            ]
            assert len(started) <= 1, f"job {job.id} was started by {started}"
        assert sum(sites.armed().values()) <= len(jobs)


def _settled(job: Job) -> bool:
    waits_for_a_person = job.state is JobState.PREPARED and job.start_requested_at is not None
    return job.state is JobState.FLYING or waits_for_a_person or job.is_over


def _runs_of(sites: Sites, job: Job) -> set[str | None]:
    return {
        event.data.job.run_id
        for service in sites.services.values()
        for event in service.events.events
        if isinstance(event.data, JobChanged) and event.data.job.id == job.id
    }
