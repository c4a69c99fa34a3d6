"""A gateway that has deleted old events joins a cluster, and keeps those that the cluster has not."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from hashlib import sha256
from pathlib import Path

import asyncpg
import pytest

from app.domain.cluster.envelope import new_events
from app.domain.cluster.errors import BusDownError
from app.domain.errors import EventsPrunedError
from app.domain.events.event import JournalHead
from app.domain.events.service import JobChanged, JobQueueChanged
from app.domain.jobs.job import JobState
from app.domain.jobs.queue import VehicleQueue
from app.services.journal import Journal, follow
from app.services.remote.journal import ClusterJournal
from app.services.retention import Retention, RetentionPeriods
from app.storage import Storage, open_storage, verify_journal
from app.storage.attachments import attachments_folder, file_path
from app.storage.postgres import ClusterStorage, open_cluster_storage, verify_cluster
from app.storage.postgres.retention import FILES_AT_ONCE
from tests.support.cluster_servers import PostgresDatabases
from tests.support.fakes import ManualClock
from tests.support.job_examples import a_job
from tests.support.old_journal import DAY_S, TODAY_S, History, at
from tests.support.service_process import until
from tests.support.verified_journal import announced


async def pruned(storage: Storage, *, relayed: int | None) -> None:
    """A round of a gateway that keeps 30 days, whose cluster has its events up to `relayed`; None: it is away."""
    clock = ManualClock(TODAY_S)
    journal = Journal(storage.events, clock)
    await journal.start()

    async def stored() -> int:
        if relayed is None:
            raise BusDownError("no NATS")
        return relayed

    retention = Retention(
        storage.retention,
        journal,
        clock,
        RetentionPeriods.of_days(30, None),
        plans_in_use=lambda: (),
        relayed=stored,
    )
    await retention.prune()
    await journal.close()


async def pruned_in(cluster: ClusterStorage) -> None:
    """A round of API nodes that keep 30 days."""
    clock = ManualClock(TODAY_S)
    journal = ClusterJournal(cluster.events, clock)
    await journal.start()
    periods = RetentionPeriods.of_days(30, None)
    await Retention(cluster.retention, journal, clock, periods, plans_in_use=lambda: ()).prune()
    await journal.close()


async def relay(gateway: Storage, cluster: ClusterStorage) -> int:
    """All that the cluster has not, page by page; how many events it has afterwards."""
    async with cluster.projection.leading() as writer:
        while True:
            head = (await writer.heads()).get(gateway.gateway_id, JournalHead())
            envelope = await gateway.relay_log.envelope("north", after=head.seq, limit=3)
            events = new_events(head, envelope)
            if not events:
                return head.seq
            await writer.append([(envelope, events)])


@asynccontextmanager
async def both(folder: Path, databases: PostgresDatabases) -> AsyncIterator[tuple[Storage, ClusterStorage, str]]:
    url = await asyncio.to_thread(databases.with_tables)
    async with (
        open_storage(folder / "journal.db") as gateway,
        open_cluster_storage(url, key_file=folder / "key") as cluster,
    ):
        yield gateway, cluster, url


async def test_events_that_the_cluster_has_not_are_kept(tmp_path: Path, databases: PostgresDatabases) -> None:
    async with both(tmp_path, databases) as (gateway, _, _):
        await History(gateway.events).items(day=1, count=9)
        await History(gateway.events).items(day=90)
        await pruned(gateway, relayed=4)
        assert [event.seq for event in await gateway.events.read(after=0, limit=99)] == [5, 6, 7, 8, 9, 10, 11]
        assert (await verify_journal(tmp_path / "journal.db")).alterations == []


async def test_old_files_go_and_no_event_does_while_the_cluster_cannot_be_asked(tmp_path: Path) -> None:
    async with open_storage(tmp_path / "journal.db") as gateway:
        history, photo = History(gateway.events), sha256(b"photo").hexdigest()
        flown = await history.run(1, await history.plan(1, day=1), day=2, ended=3)
        await gateway.attachments.put(photo, b"photo")
        os.utime(file_path(attachments_folder(tmp_path / "journal.db"), photo), (3 * DAY_S, 3 * DAY_S))
        await history.attach(flown, photo, day=3)
        await pruned(gateway, relayed=None)
        assert not await gateway.attachments.is_intact(photo)
        assert (await gateway.events.read(after=0, limit=1))[0].seq == 1
        assert (await verify_journal(tmp_path / "journal.db")).alterations == []


async def test_a_new_store_begins_where_the_gateway_s_journal_begins(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        history = History(gateway.events)
        old = await history.plan(1, day=1)
        await history.items(day=2, count=5)
        await history.run(1, old, day=69, ended=71)
        await history.run(2, old, day=90, ended=91)
        await pruned(gateway, relayed=100)
        assert await relay(gateway, cluster) == 13
        assert {run.id for run in [await cluster.runs.get(id_) for id_ in ("run-1", "run-2")] if run} == {
            "run-1",
            "run-2",
        }
        assert await cluster.plans.get(old.id) == old, "its own event was deleted, and a run uses it"
        assert (await verify_cluster(url)).alterations == []


async def test_a_store_that_was_restored_goes_on_behind_the_deleted_events(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        history = History(gateway.events)
        await history.items(day=1, count=3)
        assert await relay(gateway, cluster) == 3
        await history.items(day=2, count=4)
        await history.items(day=90, count=2)
        await pruned(gateway, relayed=100)
        assert await relay(gateway, cluster) == 10
        assert [event.seq for event in await cluster.events.read(after=0, limit=99)] == [1, 2, 3, 8, 9, 10]
        assert (await verify_cluster(url)).alterations == []


async def test_a_plan_that_a_gateway_announced_later_is_deleted_and_that_is_no_alteration(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        posted = await History(cluster.events).plan(1, day=1)
        await gateway.events.append([at(80, announced(posted))], plans=[posted])  # for a run that it then refused
        await relay(gateway, cluster)
        await pruned_in(cluster)
        assert await cluster.plans.get(posted.id) is None
        assert (await verify_cluster(url)).alterations == []


async def test_a_gateway_that_keeps_longer_brings_the_old_plan_of_a_new_run_or_job(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        history = History(gateway.events)
        flown, queued = await history.plan(1, day=1), await history.plan(2, day=1)
        await relay(gateway, cluster)
        await History(cluster.events).items(day=90)
        await pruned_in(cluster)
        assert await cluster.plans.get(flown.id) is None
        await history.run(1, flown, day=101)
        await history.job(1, queued, day=101)
        await relay(gateway, cluster)
        assert (await cluster.plans.get(flown.id), await cluster.plans.get(queued.id)) == (flown, queued)
        assert (await verify_cluster(url)).alterations == []


async def test_a_gateway_that_was_away_brings_the_plan_of_what_it_sends_late(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        history = History(gateway.events)
        posted = await history.plan(1, day=1)
        await relay(gateway, cluster)
        await history.run(1, posted, day=1.01)  # nobody hears of it
        await History(cluster.events).items(day=90)
        await pruned_in(cluster)
        assert await cluster.plans.get(posted.id) is None
        await relay(gateway, cluster)
        assert await cluster.plans.get(posted.id) == posted
        assert (await verify_cluster(url)).alterations == []


async def test_a_new_store_gets_what_only_deleted_events_told_of(tmp_path: Path, databases: PostgresDatabases) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        history = History(gateway.events)
        stopped = VehicleQueue(vehicle_id="v1", stopped=True)
        await gateway.events.append([at(1, JobQueueChanged(change="stopped", queue=stopped))], jobs=[stopped])
        old = await history.plan(1, day=1)
        flown = await history.run(1, old, day=69)
        await history.items(day=71, count=9)  # more than the first envelope has
        await history.end(flown, 72)
        await history.items(day=90)
        await pruned(gateway, relayed=100)
        await relay(gateway, cluster)
        assert await cluster.jobs.list_queues() == (stopped,)
        assert await cluster.plans.get(old.id) == old
        assert (await verify_cluster(url)).alterations == []


async def test_a_job_whose_end_was_deleted_before_what_a_site_that_was_away_said_of_it(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        history = History(cluster.events)
        posted = await history.plan(1, day=1)
        taken = a_job(1, plan_id=posted.id, plan_hash=posted.hash, created_at=2 * DAY_S, fence=1)
        over = taken.model_copy(update={"state": JobState.CANCELLED, "ended_at": 2.5 * DAY_S, "fence": 2})
        for day, change, job in ((2, "queued", taken), (2.5, "ended", over)):
            told = JobChanged.model_validate({"change": change, "actor": "ward 3", "job": job})
            await cluster.events.append([at(day, told)], jobs=[job])
        await gateway.events.append([at(75, announced(posted))], plans=[posted])
        late = JobChanged(change="returned", actor="ward 3", job=taken)
        await gateway.events.append([at(75, late)], jobs=[taken])
        await relay(gateway, cluster)
        await pruned_in(cluster)
        assert await cluster.jobs.get(taken.id) is None
        assert (await verify_cluster(url)).alterations == []


async def test_a_long_first_round_reads_little_more_than_it_deletes_before_postgresql_has_looked_at_the_table(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    """It took 20 s for 20,000 events when each row looked for the newest journal.pruned."""
    url = await asyncio.to_thread(databases.new)
    async with open_cluster_storage(url, key_file=tmp_path / "key") as cluster:
        for _ in range(3):
            await History(cluster.events).items(day=1, count=2000)
        await History(cluster.events).items(day=90)
        await pruned_in(cluster)
    looks, read = await work_on_events(url)
    assert 0 < looks < 6000 / 10, "once for each statement"
    assert 6000 <= read < 6000 * 10
    assert (await verify_cluster(url)).alterations == []


async def work_on_events(url: str) -> tuple[int, int]:
    """How often PostgreSQL has looked into the table of events, and what it has read there, by its own statistics."""
    connection = await asyncpg.connect(url)
    try:  # a connection that ends tells what it has done
        await until(lambda: connection.fetchval(_OTHERS), lambda count: count == 0, "others must end", 60.0)
        looks, read = await connection.fetchrow(_WORK)
    finally:
        await connection.close()
    return looks, read


_OTHERS = """SELECT count(*) FROM pg_stat_activity
    WHERE datname = current_database() AND backend_type = 'client backend' AND pid <> pg_backend_pid()"""
_WORK = """SELECT (seq_scan + idx_scan)::int, (seq_tup_read + (
        SELECT sum(idx_tup_read) FROM pg_stat_user_indexes AS one WHERE one.relid = events.relid))::int
    FROM pg_stat_user_tables AS events WHERE relname = 'events'"""


async def test_a_round_is_bounded_and_the_next_one_goes_on(
    tmp_path: Path, databases: PostgresDatabases, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.storage.postgres.retention.EVENTS_IN_ROUND", 500)
    async with both(tmp_path, databases) as (_, cluster, url):
        await History(cluster.events).items(day=1, count=1200)
        await History(cluster.events).items(day=90)
        begins = []
        for _ in range(4):
            await pruned_in(cluster)
            begins.append((await cluster.events.read(after=0, limit=1))[0].position)
            assert (await verify_cluster(url)).alterations == []
        assert begins == [501, 1001, 1201, 1201]


async def test_any_number_of_old_files_is_deleted(tmp_path: Path, databases: PostgresDatabases) -> None:
    async with both(tmp_path, databases) as (_, cluster, _):
        files = [b"photo %d" % number for number in range(2 * FILES_AT_ONCE + 1)]
        for content in files:
            await cluster.attachments.put(sha256(content).hexdigest(), content)
        await cluster.retention.delete_attachments(before=4e9)
        assert not await cluster.retention.has_attachments(before=4e9)


async def test_anchors_of_a_gateway_whose_events_were_all_deleted_are_no_alteration(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (gateway, cluster, url):
        await History(gateway.events).items(day=1, count=3)
        _, deleted, last = [
            JournalHead(seq=event.seq, hash=event.hash) for event in await gateway.events.read(after=0, limit=9)
        ]
        await relay(gateway, cluster)
        await History(cluster.events).items(day=90)
        await pruned_in(cluster)
        found = await verify_cluster(url, [deleted, last])
        assert (found.alterations, found.unchecked) == ([], [deleted])


async def test_a_node_that_has_not_heard_of_a_deletion_yet_tells_its_readers(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    async with both(tmp_path, databases) as (_, cluster, _):
        await History(cluster.events).items(day=1, count=5)
        await History(cluster.events).items(day=90, count=5)
        late = ClusterJournal(cluster.events, ManualClock(TODAY_S))
        await late.start()
        await late.close()  # it hears nothing more
        await pruned_in(cluster)
        with pytest.raises(EventsPrunedError) as told:
            await anext(follow(late, 3, capacity=10))
        assert told.value.first_seq == 6
        assert (await anext(follow(late, 5, capacity=10))).position == 6
        assert (await anext(follow(late, 0, capacity=10))).position == 6
