"""A relay that keeps up sends what one that reads the journal sends, and does not read what was just stored."""

from __future__ import annotations

import sqlite3
import tempfile
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.cluster.envelope import Envelope, Row
from app.domain.events import NewEvent
from app.domain.events.run import RunCreated
from app.domain.events.service import JournalPruned
from app.domain.jobs.queue import VehicleQueue
from app.domain.run.run import Run
from app.storage.database import Database
from app.storage.events import SqliteEventStore
from app.storage.migrate import migrate
from app.storage.relay import RECENT_COMMITS, RecentCommits, SqliteRelayLog
from tests.support.stored_samples import event, plan, run

T = TypeVar("T")


class CountedDatabase(Database):
    """Counts the relay's visits."""

    reads = 0

    async def read_at_once(self, work: Callable[[sqlite3.Connection], T]) -> T:
        """Count it."""
        self.reads += 1
        return await super().read_at_once(work)


@dataclass
class Follower:
    """A cluster's store, by the envelopes that it got."""

    seq: int = 0
    documents: dict[tuple[str, object], Row] = field(default_factory=dict)

    def take(self, envelope: Envelope) -> None:
        """No event is left out or comes twice."""
        seqs = [one.seq for one in envelope.events]
        assert seqs == list(range(self.seq + 1, self.seq + 1 + len(seqs))) or envelope.start is not None
        assert envelope.as_of >= seqs[-1]
        self.seq = seqs[-1]
        for kind, rows in (("plan", envelope.plans), ("run", envelope.runs)):
            self.documents |= {(kind, row["id"]): row for row in rows}
        self.documents |= {("queue", row["vehicle_id"]): row for row in envelope.queues}


@dataclass
class Gateway:
    """Its journal, the relay that keeps up, and one that reads all."""

    database: CountedDatabase
    store: SqliteEventStore
    relayed: SqliteRelayLog
    reading: SqliteRelayLog

    async def catch_up(self, follower: Follower) -> None:
        """The relay sends what it has not sent yet."""
        while follower.seq < await self.store.last_seq():
            follower.take(await self.relayed.envelope("north", after=follower.seq, limit=200))

    async def all_read(self, limit: int = 500) -> Follower:
        """What a relay sends that begins now."""
        follower = Follower()
        follower.take(await self.reading.envelope("north", after=0, limit=limit))
        return follower


@asynccontextmanager
async def gateway() -> AsyncIterator[Gateway]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "journal.db"
        migrate(path)
        database, recent = CountedDatabase(path), RecentCommits()
        try:
            yield Gateway(
                database,
                SqliteEventStore(database, "gw-1", recent),
                SqliteRelayLog(database, "gw-1", recent),
                SqliteRelayLog(database, "gw-1", RecentCommits()),
            )
        finally:
            await database.close()


def changed(number: int, at: float) -> Run:
    return run(number, plan_id=f"plan-{number}").model_copy(update={"updated_at": at})


def pruned(before: float) -> NewEvent:
    return NewEvent.of(JournalPruned(up_to=0, chains=(), before=before, attachments_before=None), 0.0)


RUNS = (1, 2, 3)
steps = st.lists(
    st.tuples(
        st.sampled_from(("event", "change", "change without an event", "created", "plan", "queue", "pruned")),
        st.sampled_from(RUNS),
        st.booleans(),
    ),
    max_size=12,
)


async def record(one: Gateway, step: str, number: int, at: float) -> None:
    """A commit."""
    of, changes = event(int(at), f"run-{number}"), (changed(number, at),)
    if step == "event":
        await one.store.append([of])
    elif step == "change":
        await one.store.append([of, event(0)], changes)
    elif step == "change without an event":
        await one.store.append([], changes)
    elif step == "created":
        await one.store.append([NewEvent.of(RunCreated(changes[0]), at, run_id=f"run-{number}")], changes)
    elif step == "plan":
        stored = plan(int(100 + at))
        await one.store.append([event(0)], plans=[stored])
    elif step == "queue":
        await one.store.append([event(0)], jobs=[VehicleQueue(vehicle_id="v1", at=at)])
    else:
        pruned = JournalPruned(up_to=0, chains=(), before=at, attachments_before=None)
        await one.store.append([NewEvent.of(pruned, at)])


@given(steps)
@settings(max_examples=40, deadline=None)
async def test_a_relay_that_keeps_up_sends_what_one_that_reads_sends(steps: Sequence[tuple[str, int, bool]]) -> None:
    async with gateway() as one:
        follower = Follower()
        await one.store.append([event(0)], [changed(number, 0.0) for number in RUNS], [plan(number) for number in RUNS])
        follower.take(await one.relayed.envelope("north", after=0, limit=200))
        for at, (step, number, waits) in enumerate(steps, 1):
            await record(one, step, number, float(at))
            while not waits and follower.seq < await one.store.last_seq():
                follower.take(await one.relayed.envelope("north", after=follower.seq, limit=2))
        for number in RUNS:
            await one.store.append([event(0, f"run-{number}")])
        while follower.seq < await one.store.last_seq():
            follower.take(await one.relayed.envelope("north", after=follower.seq, limit=200))
        read = await one.all_read()
        assert {key: follower.documents.get(key) for key in read.documents} == read.documents


def changes() -> Iterator[tuple[Sequence[NewEvent], Sequence[Run]]]:
    for number in range(10):
        yield [event(number, "run-1")], [changed(1, float(number))]


async def test_a_relay_that_keeps_up_reads_once() -> None:
    async with gateway() as one:
        follower = Follower()
        await one.store.append([event(0)], plans=[plan(1)])
        follower.take(await one.relayed.envelope("north", after=0, limit=200))
        for events, runs in changes():
            await one.store.append(events, runs)
            follower.take(await one.relayed.envelope("north", after=follower.seq, limit=200))
        assert one.database.reads == 1
        assert follower.documents == (await one.all_read()).documents | {
            key: row for key, row in follower.documents.items() if key[0] == "plan"
        }


async def test_several_commits_go_in_one_envelope_with_the_newest_of_each_run() -> None:
    async with gateway() as one:
        await one.relayed.envelope("north", after=0, limit=200)
        await one.store.append([], plans=[plan(1)])
        for events, runs in changes():
            await one.store.append(events, runs)
        envelope = await one.relayed.envelope("north", after=0, limit=200)
        assert [stored.seq for stored in envelope.events] == list(range(1, 11))
        assert [row["document"] for row in envelope.runs] == [changed(1, 9.0).model_dump_json()]
        assert len((await one.relayed.envelope("north", after=0, limit=4)).events) == 4


async def test_a_run_that_began_before_the_events_that_were_deleted_still_brings_its_plan() -> None:
    """A store that is new knows neither."""
    async with gateway() as one:
        await one.store.append([event(0)], [changed(1, 0.0)], [plan(1)])
        pruned = JournalPruned(up_to=0, chains=(), before=5000.0, attachments_before=None)
        await one.store.append([NewEvent.of(pruned, 0.0)])
        seq = (await one.relayed.envelope("north", after=0, limit=200)).events[-1].seq
        await one.store.append([event(1, "run-1")])
        (brought,) = (await one.relayed.envelope("north", after=seq, limit=200)).plans
        assert brought["id"] == "plan-1"


async def test_without_a_relay_nothing_is_kept() -> None:
    recent = RecentCommits()
    recent.add([{"seq": 1, "kind": "run.item", "run_id": None}], (), has_others=False)
    assert recent.after(0, 10) == ([], {})


@pytest.mark.parametrize("then", ["a plan", "many events", "a page"])
async def test_a_run_stored_without_its_event_comes_with_its_next_one(then: str) -> None:
    """Whatever becomes of the commits of other runs meanwhile."""
    async with gateway() as one:
        follower = Follower()
        await one.store.append([event(0, "run-1")], [changed(1, 0.0)], [plan(1)])
        follower.take(await one.relayed.envelope("north", after=0, limit=200))
        await one.store.append([], [changed(1, 7.0)])
        await one.store.append([event(0)])
        if then == "a plan":
            await one.store.append([event(0)], plans=[plan(2)])
        elif then == "many events":
            for number in range(RECENT_COMMITS):
                await one.store.append([event(number)])
        else:
            follower.take(await one.reading.envelope("north", after=follower.seq, limit=200))
        await one.catch_up(follower)
        await one.store.append([event(1, "run-1")])
        await one.catch_up(follower)
        assert follower.documents["run", "run-1"]["document"] == changed(1, 7.0).model_dump_json()


async def test_a_run_never_goes_back_to_what_it_was_before_a_deletion() -> None:
    async with gateway() as one:
        follower = Follower()
        await one.store.append([event(0, "run-1")], [changed(1, 0.0)], [plan(1)])
        follower.take(await one.relayed.envelope("north", after=0, limit=200))
        await one.store.append([event(0)], [changed(1, 5.0)], [plan(2)])
        await one.store.append([pruned(before=10.0)])
        await one.store.append([event(1, "run-1")], [changed(1, 6.0)])
        await one.catch_up(follower)
        await one.store.append([event(0)])
        await one.catch_up(follower)
        assert follower.documents["run", "run-1"]["document"] == changed(1, 6.0).model_dump_json()


async def test_an_event_brings_no_other_runs() -> None:
    """A message of one event cannot be made smaller."""
    async with gateway() as one:
        await one.store.append([event(0)], plans=[plan(1)])
        await one.relayed.envelope("north", after=0, limit=200)
        await one.store.append([], [run(number) for number in range(100)])
        await one.store.append([event(1, "run-1")])
        (brought,) = (await one.relayed.envelope("north", after=1, limit=1)).runs
        assert brought["id"] == "run-1"


@pytest.mark.parametrize("deletions", [1, 2])
async def test_what_was_read_before_a_deletion_does_not_tell_what_was_deleted(deletions: int) -> None:
    async with gateway() as one:
        await one.store.append([event(0, "run-1")], [changed(1, 0.0)], [plan(1)])
        recent = RecentCommits()
        store = SqliteEventStore(one.database, "gw-1", recent)
        if deletions > 1:
            recent.know_read(await one.reading.envelope("north", after=0, limit=200), 0.0)
            await store.append([pruned(before=10.0)])
        envelope = await one.reading.envelope("north", after=0, limit=200)
        await store.append([pruned(before=5000.0)])
        recent.know_read(envelope, 0.0)  # the reading ends only now
        seq = await store.last_seq()
        await store.append([event(1, "run-1")])
        (brought,) = (await SqliteRelayLog(one.database, "gw-1", recent).envelope("north", after=seq, limit=200)).plans
        assert brought["id"] == "plan-1"
