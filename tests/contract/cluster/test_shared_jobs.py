"""Jobs of the cluster in a real PostgreSQL: what has a lower fencing number does not count, whoever writes it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack
from dataclasses import replace
from pathlib import Path

import pytest

from app.domain.cluster.envelope import Envelope
from app.domain.errors import ConflictError
from app.domain.events import NewEvent
from app.domain.events.event import GENESIS, event_hash
from app.domain.events.service import JobChanged
from app.domain.jobs.job import Job, JobClaim, JobState, change_word
from app.domain.plan.document import document_hash
from app.domain.ports.stores import JobFilter
from app.domain.reasons import Reason, ReasonCode
from app.storage.dispatch import job_row
from app.storage.events import event_row
from app.storage.postgres import ClusterStorage, open_cluster_storage, verify, verify_cluster
from tests.support.cluster_servers import PostgresDatabases
from tests.support.job_examples import a_job
from tests.support.stored_samples import plan
from tests.support.verified_journal import DOCUMENT, announced, new_event

OPEN = JobFilter(open_only=True)
PLAN = replace(plan(), hash=document_hash(DOCUMENT), document=DOCUMENT)
WAITS = a_job(fence=1, plan_hash=PLAN.hash)
CLAIM = JobClaim(site="north", gateway="gw-north")
CLEARED = Reason.of(ReasonCode.JOB_CLAIM_CLEARED, site="north", actor="anna")


def given(job: Job, fence: int, claim: JobClaim = CLAIM) -> Job:
    """The job as a node gives it to a gateway."""
    named = {"vehicle_id": f"{claim.site}-v1", "run_id": "run-1", "claim": claim}
    return job.moved_to(JobState.PREPARING, now=2.0, **named).model_copy(update={"fence": fence})


def taken(job: Job) -> Job:
    """The job as its gateway stores it."""
    assert job.claim is not None
    return job.changed(now=3.0, claim=job.claim.model_copy(update={"taken": True}))


class Gateway:
    """The relay of one gateway's changes of jobs."""

    def __init__(self, site: str, store: ClusterStorage) -> None:
        self._site = site
        self._store = store
        self._last = (0, GENESIS)

    async def relay(self, before: Job, job: Job) -> None:
        """One event with the job as it is now."""
        seq, previous = self._last[0] + 1, self._last[1]
        changed = JobChanged(change=change_word(before, job), actor="waydrop", job=job)
        row = event_row(NewEvent.of(changed, 1000.0, vehicle_id=job.vehicle_id))
        gateway = f"gw-{self._site}"
        self._last = (seq, event_hash(previous, gateway=gateway, seq=seq, **row))
        events = [{**row, "seq": seq, "hash": self._last[1]}]
        told = {"site": self._site, "gateway": gateway, "as_of": seq, "events": events, "jobs": [job_row(job)]}
        envelope = Envelope.model_validate(told)
        async with self._store.projection.leading() as writer:
            await writer.append([(envelope, envelope.events)])


@pytest.fixture
async def url(databases: PostgresDatabases) -> str:
    """A database with the cluster's tables."""
    return await asyncio.to_thread(databases.with_tables)


@pytest.fixture
async def nodes(url: str, tmp_path: Path) -> AsyncIterator[list[ClusterStorage]]:
    """Two API nodes."""
    async with AsyncExitStack() as stack:
        yield [await stack.enter_async_context(open_cluster_storage(url, key_file=tmp_path / "key")) for _ in range(2)]


async def store(node: ClusterStorage, before: Job | None, job: Job) -> None:
    """A node changes a job."""
    changed = JobChanged(change=change_word(before, job), actor="desk", job=job)
    await node.events.append([NewEvent.of(changed, 1000.0, vehicle_id=job.vehicle_id)], jobs=[job])


async def test_of_two_nodes_that_both_give_a_job_to_a_gateway_one_is_refused(nodes: list[ClusterStorage]) -> None:
    one, other = nodes
    await store(one, None, WAITS)
    south = JobClaim(site="south", gateway="gw-south")
    claims = [store(one, WAITS, given(WAITS, 2)), store(other, WAITS, given(WAITS, 2, south))]
    results = await asyncio.gather(*claims, return_exceptions=True)
    assert sorted(type(result) for result in results if result is not None) == [ConflictError]
    stored = await one.shared_jobs.get(WAITS.id)
    assert stored is not None
    assert stored.claim == (CLAIM if results[0] is None else south)
    assert await one.events.last_seq() == 2, "nothing of the other one is stored"


async def test_a_gateway_says_more_of_its_claim_and_nothing_after_it_was_cleared(
    nodes: list[ClusterStorage], url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verify, "LOOK_AGAIN_S", 0.0)
    node, _ = nodes
    gateway, job = Gateway("north", node), given(WAITS, 2)
    await node.events.append([new_event(announced(PLAN))], plans=[PLAN])
    await store(node, None, WAITS)
    await store(node, WAITS, job)
    await gateway.relay(job, taken(job))
    assert await node.jobs.site_of(job.id) == "north"
    assert await node.shared_jobs.get(job.id) == taken(job)
    cleared = taken(job).taken_back(CLEARED, now=4.0).model_copy(update={"fence": 3})
    await store(node, taken(job), cleared)
    flying = taken(job).moved_to(JobState.FLYING, now=5.0)
    await gateway.relay(taken(job), flying)
    assert await node.shared_jobs.get(job.id) == cleared
    assert list(await node.shared_jobs.list_jobs(OPEN, limit=10)) == [cleared]
    ended = cleared.moved_to(JobState.CANCELLED, now=6.0)
    await gateway.relay(flying, flying.model_copy(update={"fence": 3}))
    assert await node.shared_jobs.get(job.id) == cleared, "the cluster has given it to nobody with this number"
    assert (await verify_cluster(url)).alterations == [], "the verification has the same rules"
    await store(node, cleared, ended.model_copy(update={"fence": 4}))


@pytest.mark.parametrize("told", [JobState.FLYING, JobState.CANCELLED])
async def test_a_claim_is_not_cleared_once_its_gateway_has_told_more_of_the_job(
    nodes: list[ClusterStorage], told: JobState
) -> None:
    """While a node asks the gateway, which is cut off, what it did may arrive: else the job would fly twice."""
    node, _ = nodes
    gateway, job = Gateway("north", node), given(WAITS, 2)
    await store(node, None, WAITS)
    await store(node, WAITS, job)
    await gateway.relay(job, taken(job))
    read = await node.shared_jobs.get(job.id)
    assert read is not None
    newer = read.moved_to(told, now=4.0)
    await gateway.relay(read, newer)
    cleared = read.taken_back(CLEARED, now=5.0).model_copy(update={"fence": 3})
    with pytest.raises(ConflictError, match="meanwhile"):
        await store(node, read, cleared)
    assert await node.shared_jobs.get(job.id) == newer


async def test_a_job_that_was_given_back_is_found_and_one_of_a_single_site_is_not_shared(
    nodes: list[ClusterStorage],
) -> None:
    node, _ = nodes
    gateway, job = Gateway("north", node), given(WAITS, 2)
    await store(node, None, WAITS)
    await store(node, WAITS, job)
    back = job.requeued(Reason.of(ReasonCode.JOB_NEVER_CAME), now=3.0)
    await gateway.relay(job, back)
    assert list(await node.shared_jobs.returned()) == [back]
    local = a_job(2)
    await gateway.relay(local, local.changed(now=2.0, priority=1))
    assert [one.id for one in await node.jobs.list_jobs(OPEN, limit=10)] == [local.id]
    assert list(await node.shared_jobs.list_jobs(OPEN, limit=10)) == []
    waits = back.taken_back(back.reason, now=4.0).model_copy(update={"fence": 3})
    await store(node, back, waits)
    assert list(await node.shared_jobs.returned()) == []


async def test_a_gateway_that_relays_its_journal_to_an_empty_store_gives_no_job_back(
    nodes: list[ClusterStorage],
) -> None:
    node, _ = nodes
    job = given(WAITS, 2)
    back = job.requeued(Reason.of(ReasonCode.JOB_NEVER_CAME), now=3.0)
    await Gateway("north", node).relay(job, back)
    assert await node.jobs.get(job.id) == back
    assert list(await node.shared_jobs.returned()) == [], "another gateway may have flown it since"
