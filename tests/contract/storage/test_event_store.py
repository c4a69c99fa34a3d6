"""What every EventStore promises."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from app.domain.errors import InvalidInputError, StorageError
from app.domain.events import AnyPayload, Event, NewEvent
from app.domain.events.run import RunItemEnded
from app.domain.events.vehicle import OffboardChanged, OffboardLease, TasksChanged, TasksGripper, VehicleRebooted
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.run.run import RunState
from app.storage import open_storage
from app.storage.postgres import open_cluster_storage
from tests.contract.storage.conftest import Opener, Stores
from tests.support.cluster_servers import PostgresDatabases
from tests.support.events import data_of
from tests.support.stored_samples import event, plan, run


def seqs(events: Sequence[Event]) -> list[int]:
    return [stored.seq for stored in events]


async def test_an_empty_journal_ends_at_0(stores: Stores) -> None:
    assert await stores.events.last_seq() == 0
    assert list(await stores.events.read(after=0, limit=10)) == []


async def test_events_are_numbered_from_1_in_the_order_given(stores: Stores) -> None:
    stored = await stores.events.append([event(7), event(8)])
    assert seqs(stored) == [1, 2]
    assert [data_of(one)["seq"] for one in stored] == [7, 8]
    assert seqs(await stores.events.append([event(9)])) == [3]
    assert await stores.events.last_seq() == 3


async def test_what_append_returned_is_what_read_gives(stores: Stores) -> None:
    stored = await stores.events.append([event(1, item_id="größe ☂\n\0"), event(2)])
    assert list(await stores.events.read(after=0, limit=10)) == list(stored)
    assert all(type(one) is Event and one.gateway == stores.gateway_id for one in stored)


async def test_times_keep_every_bit(stores: Stores) -> None:
    exact = event()._replace(time=1763724799.123456789)
    (stored,) = await stores.events.append([exact])
    assert (await stores.events.read(after=0, limit=1))[0].time == exact.time == stored.time


async def test_read_starts_after_and_stops_at_the_limit(stores: Stores) -> None:
    await stores.events.append([event(n) for n in range(10)])
    assert seqs(await stores.events.read(after=3, limit=4)) == [4, 5, 6, 7]
    assert seqs(await stores.events.read(after=8, limit=4)) == [9, 10]
    assert seqs(await stores.events.read(after=10, limit=4)) == []
    assert seqs(await stores.events.read(after=0, limit=0)) == []


async def test_read_of_a_run_gives_only_its_events(stores: Stores) -> None:
    await stores.events.append([event(1, "run-1"), event(2, "run-2"), event(3), event(4, "run-1")])
    assert seqs(await stores.events.read(after=0, limit=10, run_id="run-1")) == [1, 4]
    assert seqs(await stores.events.read(after=1, limit=10, run_id="run-1")) == [4]
    assert seqs(await stores.events.read(after=0, limit=1, run_id="run-1")) == [1]
    assert seqs(await stores.events.read(after=0, limit=10, run_id="nobody")) == []


async def test_the_last_of_offboard_control_is_the_newest_of_each_kind_per_vehicle(stores: Stores) -> None:
    lease: AnyPayload = OffboardLease(change=LeaseChange.ACQUIRED, holder="ann")
    changed: AnyPayload = OffboardChanged(state=OffboardState.LEASED, holder="ann")
    tasks: AnyPayload = TasksChanged(change="cleared", task_id=None, task=None, holder="ann", task_list=(0,))
    told = [(lease, "v1"), (lease, "v2"), (changed, "v1"), (changed, "v1"), (tasks, "v2"), (lease, "v1")]
    others = [(VehicleRebooted(), "v1"), (TasksGripper(task_id="t1", action="release", outcome="sent"), "v1")]
    await stores.events.append([NewEvent.of(one, 1.0, vehicle_id=vehicle_id) for one, vehicle_id in told + others])
    last = await stores.events.last_offboard()
    assert seqs(last) == [2, 4, 5, 6]
    assert list(last) == [one for one in await stores.events.read(after=0, limit=10) if one.seq in (2, 4, 5, 6)]


async def test_runs_are_stored_with_their_events(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    await stores.events.append([event(1, "run-1")], [run()])
    assert await stores.runs.get("run-1") == run()


async def test_a_run_may_change_without_an_event(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    assert list(await stores.events.append([], [run()])) == []
    assert await stores.runs.get("run-1") == run()
    assert await stores.events.last_seq() == 0


async def test_of_a_run_given_twice_the_last_counts(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    await stores.events.append([event()], [run(), run(state=RunState.UPLOADING)])
    assert (await stores.runs.get("run-1")) == run(state=RunState.UPLOADING)


async def test_an_append_that_cannot_be_stored_stores_nothing_and_takes_no_number(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    with pytest.raises(StorageError):
        await stores.events.append([event(1), event(2)], [run(1)], [plan()])
    assert await stores.events.last_seq() == 0
    assert await stores.runs.get("run-1") is None
    assert seqs(await stores.events.append([event(3)])) == [1]


@pytest.mark.parametrize("bad", [math.nan, math.inf])
async def test_data_that_is_not_json_is_refused_whole(stores: Stores, bad: float) -> None:
    ended = RunItemEnded(item_id="clinic", began_s=bad, ended_s=None)
    with pytest.raises(InvalidInputError, match=r"run\.item_ended"):
        await stores.events.append([event(1), NewEvent.of(ended, 2.0)])
    assert await stores.events.last_seq() == 0


async def test_appends_at_once_leave_no_gap_and_keep_each_call_together(stores: Stores) -> None:
    calls = await asyncio.gather(*(stores.events.append([event(n), event(n), event(n)]) for n in range(20)))
    for stored in calls:
        first = stored[0].seq
        assert seqs(stored) == [first, first + 1, first + 2]
    assert sorted(seq for stored in calls for seq in seqs(stored)) == list(range(1, 61))
    assert seqs(await stores.events.read(after=0, limit=100)) == list(range(1, 61))


async def test_numbering_goes_on_after_a_restart_under_the_same_gateway(opener: Opener) -> None:
    async with opener() as stores:
        before = list(await stores.events.append([event(1), event(2)]))
    async with opener() as stores:
        assert list(await stores.events.read(after=0, limit=10)) == before
        (after,) = await stores.events.append([event(3)])
    assert (after.seq, after.gateway) == (3, before[0].gateway)


async def test_two_journals_have_two_gateways(tmp_path: Path, databases: PostgresDatabases) -> None:
    async with open_storage(tmp_path / "1.db") as one, open_storage(tmp_path / "2.db") as two:
        assert one.gateway_id != two.gateway_id
    key_file = tmp_path / "secret.key"
    urls = await asyncio.gather(*(asyncio.to_thread(databases.new) for _ in range(2)))
    async with (
        open_cluster_storage(urls[0], key_file=key_file) as first,
        open_cluster_storage(urls[1], key_file=key_file) as second,
    ):
        assert first.gateway_id != second.gateway_id


async def test_a_cancelled_append_stores_all_or_nothing_and_harms_no_later_one(stores: Stores) -> None:
    for step in range(25):  # cut it off ever later
        task = asyncio.ensure_future(stores.events.append([event(step), event(step)]))
        await asyncio.wait({task}, timeout=step * 0.0002)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
    (last,) = await stores.events.append([event(99)])
    stored = await stores.events.read(after=0, limit=100)
    assert seqs(stored) == list(range(1, last.seq + 1))
    numbers = [data_of(one)["seq"] for one in stored[:-1]]
    assert numbers[::2] == numbers[1::2]
