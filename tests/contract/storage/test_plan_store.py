"""What every PlanStore promises."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.errors import StorageError
from tests.contract.storage.conftest import Opener, Stores
from tests.support.stored_samples import plan


async def test_an_unknown_plan_is_none(stores: Stores) -> None:
    assert await stores.plans.get("plan-1") is None


async def test_a_plan_comes_back_as_it_was_stored(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    assert await stores.plans.get("plan-1") == plan()


async def test_a_plan_survives_a_restart(opener: Opener) -> None:
    async with opener() as stores:
        await stores.events.append([], plans=[plan()])
    async with opener() as stores:
        assert await stores.plans.get("plan-1") == plan()


async def test_a_plan_is_never_replaced(stores: Stores) -> None:
    await stores.events.append([], plans=[plan()])
    with pytest.raises(StorageError):
        await stores.events.append([], plans=[replace(plan(), name="another")])
    assert await stores.plans.get("plan-1") == plan()


async def test_two_plans_may_have_the_same_hash(stores: Stores) -> None:
    await stores.events.append([], plans=[plan(1)])
    await stores.events.append([], plans=[plan(2)])
    assert {one.hash for one in await stores.plans.list_plans(limit=10)} == {"sha256:0"}


async def test_plans_are_listed_newest_first_even_if_the_clock_goes_back(stores: Stores) -> None:
    await stores.events.append([], plans=[replace(plan(1), created_at=2000.0)])
    await stores.events.append([], plans=[replace(plan(2), created_at=1000.0)])
    assert [one.id for one in await stores.plans.list_plans(limit=10)] == ["plan-2", "plan-1"]
    assert [one.id for one in await stores.plans.list_plans(limit=1)] == ["plan-2"]


async def test_the_next_page_begins_behind_the_plan_that_the_last_one_ended_with(stores: Stores) -> None:
    for number in range(1, 6):
        await stores.events.append([], plans=[plan(number)])
    assert [one.id for one in await stores.plans.list_plans(limit=2, older_than="plan-4")] == ["plan-3", "plan-2"]
    assert [one.id for one in await stores.plans.list_plans(limit=2, older_than="plan-2")] == ["plan-1"]
    assert await stores.plans.list_plans(limit=2, older_than="plan-1") == ()
    assert await stores.plans.list_plans(limit=2, older_than="plan-9") == ()
