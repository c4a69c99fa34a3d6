"""What retention promises on every store: old data goes, whatever is in use stays, and the chain proves the place."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from app.domain.errors import EventsPrunedError, StorageError
from app.domain.events import Event, EventKind, NewEvent
from app.domain.events.event import JournalHead
from app.domain.events.run import RunChanged
from app.domain.events.service import JournalPruned
from app.domain.plan.document import document_hash
from app.domain.ports.stores import ALL_JOBS, ALL_RUNS, PrunedTo, RetentionStore
from app.domain.run.run import PlanChange
from app.domain.vehicle.state import InFlight
from app.services.journal import Journal, follow, kept_after
from app.services.remote.journal import ClusterJournal
from app.services.retention import DAY_S, Retention, RetentionPeriods
from app.storage import Verification, open_storage, verify_journal
from app.storage.postgres import open_cluster_storage, verify_cluster
from tests.contract.storage.conftest import Stores
from tests.support.cluster_servers import PostgresDatabases
from tests.support.fakes import ManualClock
from tests.support.old_journal import TODAY_S, History, at, ids
from tests.support.stored_samples import plan
from tests.support.verified_journal import DOCUMENT, announced

Verify = Callable[[Sequence[JournalHead]], Awaitable[Verification]]
KEPT_DAYS = 30


@dataclass
class Kept:
    """A journal that keeps 30 days, on the hundredth."""

    stores: Stores
    journal: Journal | ClusterJournal
    clock: ManualClock
    verify: Verify
    in_use: list[str] = field(default_factory=list)

    @property
    def history(self) -> History:
        return History(self.stores.events)

    async def prune(
        self,
        *,
        days: int | None = KEPT_DAYS,
        attachments: int | None = None,
        through: RetentionStore | None = None,
    ) -> None:
        await self.journal.close()
        await self.journal.start()  # what the history stored was not recorded by it
        retention = Retention(
            through or self.stores.retention,
            self.journal,
            self.clock,
            RetentionPeriods.of_days(days, attachments),
            plans_in_use=lambda: self.in_use,
        )
        await retention.prune()

    async def positions(self) -> list[int]:
        return [event.position for event in await self.stores.events.read(after=0, limit=10_000)]

    async def pruned(self) -> list[Event]:
        events = await self.stores.events.read(after=0, limit=10_000)
        return [event for event in events if event.kind is EventKind.JOURNAL_PRUNED]

    async def runs(self) -> list[str]:
        return ids(await self.stores.runs.list_runs(ALL_RUNS, limit=100))

    async def jobs(self) -> list[str]:
        return ids(await self.stores.jobs.list_jobs(ALL_JOBS, limit=100))

    async def plans(self) -> list[str]:
        return ids(await self.stores.plans.list_plans(limit=100))

    async def alterations(self, *anchors: JournalHead) -> Sequence[str]:
        return (await self.verify(anchors)).alterations


Opened = Callable[[], AbstractAsyncContextManager[Kept]]


@pytest.fixture(params=["postgres", "sqlite"])
def opened(request: pytest.FixtureRequest, tmp_path: Path) -> Opened:
    """Opens the same journal each time it is called."""
    if request.param == "sqlite":
        return lambda: _on_sqlite(tmp_path / "journal.db")
    databases: PostgresDatabases = request.getfixturevalue("databases")
    url = databases.with_tables()
    return lambda: _on_postgres(url, tmp_path / "secret.key")


@asynccontextmanager
async def _on_sqlite(path: Path) -> AsyncIterator[Kept]:
    async with open_storage(path) as storage:
        clock = ManualClock(TODAY_S)
        journal = Journal(storage.events, clock)
        await journal.start()
        yield Kept(storage, journal, clock, lambda anchors: verify_journal(path, anchors))
        await journal.close()


@asynccontextmanager
async def _on_postgres(url: str, key: Path) -> AsyncIterator[Kept]:
    async with open_cluster_storage(url, key_file=key) as storage:
        clock = ManualClock(TODAY_S)
        journal = ClusterJournal(storage.events, clock)
        await journal.start()
        yield Kept(storage, journal, clock, lambda anchors: verify_cluster(url, anchors))
        await journal.close()


@pytest.fixture
async def kept(opened: Opened) -> AsyncIterator[Kept]:
    async with opened() as one:
        yield one


async def test_events_older_than_the_period_are_deleted_and_the_journal_says_so(kept: Kept) -> None:
    await kept.history.items(day=1, count=5)
    await kept.history.items(day=69, count=450)
    await kept.history.items(day=71, count=3)
    await kept.prune()
    assert await kept.positions() == [456, 457, 458, 459]
    (told,) = await kept.pruned()
    assert told.data.model_dump() == {
        "up_to": 455,
        "chains": ({"gateway": told.gateway, "seq": 455, "hash": told.data.model_dump()["chains"][0]["hash"]},),
        "before": TODAY_S - KEPT_DAYS * DAY_S,
        "attachments_before": None,
    }
    assert await kept.alterations() == []


async def test_nothing_is_deleted_and_nothing_recorded_without_a_period(kept: Kept) -> None:
    await kept.history.items(day=1, count=5)
    await kept.prune(days=None)
    assert await kept.positions() == [1, 2, 3, 4, 5]


async def test_a_second_round_finds_nothing_more_until_more_is_old(kept: Kept) -> None:
    await kept.history.items(day=1, count=5)
    await kept.history.items(day=90, count=2)
    await kept.prune()
    await kept.prune()
    assert await kept.positions() == [6, 7, 8]
    kept.clock.time_s += 21 * DAY_S
    await kept.prune()
    assert await kept.positions() == [8, 9]
    assert await kept.alterations() == []


async def test_ended_runs_and_jobs_and_unused_plans_go_with_their_events(kept: Kept) -> None:
    history = kept.history
    used, _ = await history.plan(1, day=1), await history.plan(2, day=1)
    await history.run(1, used, day=2, ended=2.1)
    await history.job(1, used, day=3, ended=3.1)
    recent = await history.plan(3, day=80)
    await history.run(2, recent, day=81, ended=81.1)
    await kept.prune()
    assert (await kept.runs(), await kept.jobs(), await kept.plans()) == (["run-2"], [], ["plan-3"])
    assert await kept.alterations() == []


async def test_an_old_plan_stays_while_a_run_or_a_job_uses_it(kept: Kept) -> None:
    history = kept.history
    flown, queued = await history.plan(1, day=1), await history.plan(2, day=1)
    await history.run(1, flown, day=1.5, ended=1.6)
    await history.run(2, flown, day=90, ended=90.1)
    await history.job(1, queued, day=91)
    await kept.prune()
    assert await kept.plans() == ["plan-1", "plan-2"]
    assert await kept.alterations() == [], "their runs and jobs say which plans they are"
    kept.clock.time_s += 25 * DAY_S
    await kept.prune()
    assert (await kept.runs(), await kept.plans()) == ([], ["plan-2"]), "the job is open"


async def test_a_plan_that_is_in_use_at_this_moment_is_deleted_once_it_is_not(kept: Kept) -> None:
    await kept.history.plan(1, day=1)
    await kept.history.items(day=90)
    kept.in_use = ["plan-1"]
    await kept.prune()
    assert (await kept.plans(), await kept.alterations()) == (["plan-1"], []), "a run may be made of it next"
    kept.in_use = []
    await kept.prune()
    assert (await kept.plans(), await kept.alterations()) == ([], [])


async def test_a_plan_that_a_change_in_flight_is_to_bring_stays(kept: Kept) -> None:
    history = kept.history
    await history.plan(1, day=1)
    flown = await history.run(1, await history.plan(2, day=90), day=91)
    change = PlanChange(
        plan_id="plan-1",
        plan_hash=flown.plan_hash,
        mission_hash="",
        mission_id=1,
        continue_at="drop-1",
        omitted=(),
        began=InFlight(latitude_deg=1.0, longitude_deg=2.0, relative_altitude_m=3.0),
        actor="ward 3",
        at=91 * DAY_S,
    )
    changing = flown.model_copy(update={"changing": change})
    await kept.stores.events.append([at(91, RunChanged(changing), flown.id)], [changing])
    await kept.prune()
    assert (await kept.plans(), await kept.alterations()) == (["plan-1", "plan-2"], [])


async def test_a_plan_that_was_announced_by_a_clock_behind_its_own_time_ends_no_round(kept: Kept) -> None:
    edge_s = TODAY_S - KEPT_DAYS * DAY_S
    accepted = replace(plan(1), hash=document_hash(DOCUMENT), document=DOCUMENT, created_at=edge_s + 0.2)
    accepted = replace(accepted, name=str(DOCUMENT["name"]))
    await kept.stores.events.append([NewEvent.of(announced(accepted), edge_s - 0.3)], plans=[accepted])
    await kept.history.items(day=90)
    await kept.prune()
    assert (await kept.plans(), await kept.alterations()) == (["plan-1"], [])
    kept.clock.time_s += DAY_S
    await kept.history.items(day=69)
    await kept.prune()
    assert (await kept.alterations()) == []


async def test_no_event_of_an_open_run_is_deleted_and_none_after_it(kept: Kept) -> None:
    history = kept.history
    await history.items(day=1)
    await history.run(1, await history.plan(1, day=2), day=2.5)
    await history.items(day=3)
    await kept.prune()
    assert (await kept.positions())[0] == 3, "it begins with the run's first event"
    assert (await kept.runs(), await kept.plans(), await kept.alterations()) == (["run-1"], ["plan-1"], [])


async def test_the_oldest_run_or_job_that_keeps_events_is_named(kept: Kept) -> None:
    history = kept.history
    assert await kept.stores.retention.oldest_open() is None
    plan = await history.plan(1, day=1)
    await history.run(1, plan, day=2, ended=2.5)
    await history.run(2, plan, day=4)
    await history.job(1, plan, day=3)
    assert await kept.stores.retention.oldest_open() == ("job-1", 3 * DAY_S)


async def test_an_event_of_a_clock_that_was_ahead_keeps_the_later_ones_and_is_named(kept: Kept) -> None:
    await kept.history.items(day=1, count=2)
    await kept.history.items(day=9999)
    await kept.history.items(day=2, count=2)
    with capture_logs() as logs:
        await kept.prune()
    assert (await kept.positions())[0] == 3
    told = [{"position": line["position"], "time": line["time"]} for line in logs if "future" in line["event"]]
    assert told == [{"position": 3, "time": 9999 * DAY_S}]


async def test_no_event_of_an_open_job_is_deleted(kept: Kept) -> None:
    history = kept.history
    await history.items(day=1)
    await history.job(1, await history.plan(1, day=2), day=2.5)
    await kept.prune()
    assert (await kept.positions())[0] == 3
    assert (await kept.jobs(), await kept.plans(), await kept.alterations()) == (["job-1"], ["plan-1"], [])


async def test_a_run_that_ended_within_the_period_stays_whole_in_its_table(kept: Kept) -> None:
    history = kept.history
    flown = await history.run(1, await history.plan(1, day=60), day=69, ended=71)
    await kept.prune()
    assert await kept.stores.runs.get("run-1") == flown
    assert await kept.alterations() == []


async def test_what_was_attached_later_does_not_keep_a_run(kept: Kept) -> None:
    history = kept.history
    flown = await history.run(1, await history.plan(1, day=1), day=2, ended=2.1)
    content = b"\xff\xd8\xff1"
    await kept.stores.attachments.put(sha256(content).hexdigest(), content)
    await history.attach(flown, sha256(content).hexdigest(), day=99)
    await kept.prune()
    assert (await kept.runs(), await kept.alterations()) == ([], [])


async def test_files_go_after_their_own_period_and_the_journal_knows_that(kept: Kept) -> None:
    history = kept.history
    flown = await history.run(1, await history.plan(1, day=80), day=81, ended=81.1)
    content = b"\xff\xd8\xff1"
    named = sha256(content).hexdigest()
    await kept.stores.attachments.put(named, content)
    await history.attach(flown, named, day=82)
    await kept.prune(attachments=10)
    assert await kept.stores.attachments.is_intact(named), "the file itself is of today"
    kept.clock.time_s = 4e9  # long after today
    await kept.prune(days=None, attachments=10)
    assert not await kept.stores.attachments.is_intact(named)
    (told,) = await kept.pruned()
    assert (told.data.model_dump()["up_to"], told.data.model_dump()["before"]) == (0, None)
    assert await kept.alterations() == []


async def test_a_reader_is_told_of_deleted_events(kept: Kept) -> None:
    await kept.history.items(day=1, count=5)
    await kept.history.items(day=90, count=2)
    await kept.prune()
    assert (kept_after(kept.journal, 0), kept_after(kept.journal, 5)) == (5, 5)
    with pytest.raises(EventsPrunedError) as refused:
        kept_after(kept.journal, 3)
    assert refused.value.extra["first_seq"] == 6
    oldest = await anext(follow(kept.journal, 0, capacity=10))
    assert oldest.position == 6
    with pytest.raises(EventsPrunedError):
        await anext(follow(kept.journal, 3, capacity=10))


async def test_an_anchor_of_a_deleted_event_is_named_and_the_one_at_the_place_is_checked(kept: Kept) -> None:
    await kept.history.items(day=1, count=5)
    events = await kept.stores.events.read(after=0, limit=5)
    anchors = [JournalHead(seq=event.seq, hash=event.hash) for event in events]
    await kept.history.items(day=90, count=2)
    await kept.prune()
    found = await kept.verify([anchors[2], anchors[4]])
    assert (found.alterations, found.unchecked) == ([], [anchors[2]])
    beyond = JournalHead(seq=99, hash=anchors[2].hash)
    assert ["event 99 existed and is missing" in line for line in await kept.alterations(beyond)] == [True]


class BreakingOff:
    """A RetentionStore whose disk fails after the first part."""

    def __init__(self, store: RetentionStore) -> None:
        self._store = store
        self._parts = 0

    async def oldest_open(self) -> tuple[str, float] | None:
        return await self._store.oldest_open()

    async def first_younger(self, *, before: float) -> tuple[int, float] | None:
        return await self._store.first_younger(before=before)

    async def prunable(self, *, before: float, up_to: int) -> PrunedTo | None:
        return await self._store.prunable(before=before, up_to=up_to)

    async def delete_plans(self, *, before: float, spared: Sequence[str]) -> bool:
        return await self._store.delete_plans(before=before, spared=spared)

    async def prune(self, pruned: JournalPruned) -> bool:
        self._parts += 1
        if self._parts > 1:
            raise StorageError("the disk failed")
        return await self._store.prune(pruned)

    async def has_attachments(self, *, before: float) -> bool:
        return await self._store.has_attachments(before=before)

    async def delete_attachments(self, *, before: float) -> None:
        await self._store.delete_attachments(before=before)


async def test_a_round_that_was_broken_off_is_ended_by_the_next(kept: Kept) -> None:
    await kept.history.items(day=1, count=450)
    await kept.history.items(day=90, count=2)
    with pytest.raises(StorageError):
        await kept.prune(through=BreakingOff(kept.stores.retention))
    assert (await kept.positions())[0] == 201
    assert await kept.alterations() == [], "what is left of the deleted events is no alteration"
    await kept.prune()
    assert await kept.positions() == [451, 452, 453]
    assert len(await kept.pruned()) == 1
    assert await kept.alterations() == []


async def test_what_a_broken_off_round_has_left_without_a_proof_is_told_and_no_alteration(kept: Kept) -> None:
    plan = await kept.history.plan(1, day=1)
    await kept.history.items(day=1, count=197)
    await kept.history.run(1, plan, day=1, ended=1.1)
    await kept.history.items(day=2, count=10)
    await kept.history.items(day=90)
    with pytest.raises(StorageError):
        await kept.prune(through=BreakingOff(kept.stores.retention))
    assert ((await kept.positions())[0], await kept.runs()) == (201, ["run-1"]), "its end is the first that is left"
    found = await kept.verify([])
    assert (found.alterations, found.unproven) == (
        [],
        [
            "event 201 is deleted by age next: nothing proves its content",
            "run run-1 is deleted by age next: nothing proves it",
        ],
    )
    await kept.prune()
    found = await kept.verify([])
    assert (found.alterations, found.unproven) == ([], [])
