"""What every JobStore promises."""

from __future__ import annotations

from app.domain.jobs.job import JobState, VehicleSelector
from app.domain.jobs.queue import VehicleQueue
from app.domain.ports.stores import ALL_JOBS, JobFilter
from tests.contract.storage.conftest import Opener, Stores
from tests.support.job_examples import a_job
from tests.support.reasons import some
from tests.support.stored_samples import event, plan


async def ids(stores: Stores, wanted: JobFilter = ALL_JOBS, limit: int = 50) -> list[str]:
    return [job.id for job in await stores.jobs.list_jobs(wanted, limit=limit)]


async def test_jobs_and_queues_survive_a_restart_with_the_events_that_tell_of_them(opener: Opener) -> None:
    job, queue = a_job(1, not_before=5.5), VehicleQueue(vehicle_id="v1", stopped=True, reason=some("größe ☂"), at=1.5)
    async with opener() as stores:
        await stores.events.append([], plans=[plan()])
        await stores.events.append([event()], jobs=[job, queue])
    async with opener() as stores:
        assert await stores.jobs.get("job-1") == job
        assert list(await stores.jobs.list_queues()) == [queue]
        assert await stores.jobs.get("job-2") is None
        assert await stores.events.last_seq() == 1


async def test_the_last_of_several_versions_counts(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    first, queue = a_job(1), VehicleQueue(vehicle_id="v1")
    second = first.model_copy(update={"state": JobState.CANCELLED})
    await stores.events.append([event()], jobs=[first, queue, second, queue.cleared("run-1")])
    assert await stores.jobs.get("job-1") == second
    assert await ids(stores, JobFilter(open_only=True)) == []
    await stores.events.append([event()], jobs=[queue.cleared("run-2")])
    assert [one.cleared_run_id for one in await stores.jobs.list_queues()] == ["run-2"]


async def test_every_condition_of_a_filter_must_hold_and_pages_follow_each_other(stores: Stores) -> None:
    await stores.events.append([], plans=[plan(1), plan(2)])
    made = [
        a_job(1, vehicle="v1"),
        a_job(2, vehicle_id="v1", state=JobState.FLYING),
        a_job(3, plan_id="plan-2"),
        a_job(4, selector=VehicleSelector(vehicle="v1"), state=JobState.EXPIRED),
    ]
    for job in made:
        await stores.events.append([], jobs=[job])
    assert await ids(stores) == ["job-4", "job-3", "job-2", "job-1"]
    assert await ids(stores, limit=2) == ["job-4", "job-3"]
    assert await ids(stores, JobFilter(older_than="job-3")) == ["job-2", "job-1"]
    assert await ids(stores, JobFilter(vehicle_id="v1")) == ["job-4", "job-2", "job-1"]
    assert await ids(stores, JobFilter(vehicle_id="v1", open_only=True)) == ["job-2", "job-1"]
    assert await ids(stores, JobFilter(plan_id="plan-2")) == ["job-3"]
    states = frozenset({JobState.FLYING, JobState.EXPIRED})
    assert await ids(stores, JobFilter(states=states)) == ["job-4", "job-2"]
