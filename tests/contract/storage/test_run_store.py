"""What every RunStore promises. Runs are written by EventStore.append."""

from __future__ import annotations

from app.domain.ports.stores import ALL_RUNS, RunFilter
from app.domain.run.run import Run, RunState
from tests.contract.storage.conftest import Opener, Stores
from tests.support.stored_samples import plan, run


async def store(stores: Stores, *runs: Run) -> None:
    await stores.events.append([], runs)


async def test_an_unknown_run_is_none(stores: Stores) -> None:
    assert await stores.runs.get("run-1") is None


async def test_a_run_comes_back_as_it_was_stored_last(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    await store(stores, run())
    flown = run(state=RunState.FLYING).model_copy(
        update={"flown_item_ids": ("a", "b"), "reached_seq": 4, "mission_id": 2**32 - 1, "updated_at": 1234.5678}
    )
    await store(stores, flown)
    assert await stores.runs.get("run-1") == flown


async def test_a_run_survives_a_restart(opener: Opener) -> None:
    async with opener() as stores:
        await stores.events.append([], plans=[plan()])
        await store(stores, run())
    async with opener() as stores:
        assert await stores.runs.get("run-1") == run()


async def test_runs_are_listed_newest_first_and_a_change_moves_none(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    for number in (3, 1, 2):
        await store(stores, run(number))
    await store(stores, run(3, state=RunState.UPLOADING))
    listed = await stores.runs.list_runs(ALL_RUNS, limit=10)
    assert [one.id for one in listed] == ["run-2", "run-1", "run-3"]
    assert [one.id for one in await stores.runs.list_runs(ALL_RUNS, limit=2)] == ["run-2", "run-1"]


async def test_runs_are_listed_by_vehicle_and_by_being_open(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    await store(
        stores,
        run(1, vehicle_id="v1", state=RunState.COMPLETED),
        run(2, vehicle_id="v1", state=RunState.FLYING),
        run(3, vehicle_id="v2", state=RunState.LANDED),
        run(4, vehicle_id="v2", state=RunState.FAILED),
    )
    assert {one.id for one in await stores.runs.list_runs(RunFilter(vehicle_id="v1"), limit=10)} == {"run-1", "run-2"}
    assert {one.id for one in await stores.runs.list_runs(RunFilter(open_only=True), limit=10)} == {"run-2", "run-3"}
    both = RunFilter(vehicle_id="v1", open_only=True)
    assert [one.id for one in await stores.runs.list_runs(both, limit=10)] == ["run-2"]


async def test_a_run_that_ends_is_open_no_more(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    await store(stores, run(state=RunState.FLYING))
    await store(stores, run(state=RunState.ABORTED))
    assert list(await stores.runs.list_runs(RunFilter(open_only=True), limit=10)) == []
