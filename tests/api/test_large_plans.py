"""Large plans are checked in the worker process: like any other, and also while that is killed."""

from __future__ import annotations

import asyncio
import os
import signal
from typing import Any

import pytest

from app.services.plan_work import LARGE_ENTRIES
from tests.support.service_in_process import Service
from tests.support.workers import workers_of


@pytest.fixture
def large_plan(plan: dict[str, Any]) -> dict[str, Any]:
    """With waypoints to and fro before its first one."""
    point = next(item for item in plan["items"] if item["type"] == "waypoint")
    first = plan["items"].index(point)
    more = [
        {**point, "id": f"more-{number}", "latitude_deg": point["latitude_deg"] + 0.0002 * (number % 2)}
        for number in range(3 * LARGE_ENTRIES)
    ]
    return {**plan, "items": [*plan["items"][:first], *more, *plan["items"][first:]]}


async def check(service: Service, document: Any, **options: Any) -> dict[str, Any]:
    status, _, found = await service.call("POST", "/api/v1/plan-checks", json={"plan": document, **options})
    assert status == 200, found
    return dict(found)


async def test_small_plans_need_no_worker_and_large_ones_start_it_once(
    service: Service, plan: dict[str, Any], large_plan: dict[str, Any]
) -> None:
    await check(service, plan)
    assert workers_of(os.getpid()) == []
    await check(service, large_plan)
    (worker,) = workers_of(os.getpid())
    await check(service, large_plan)
    assert workers_of(os.getpid()) == [worker]


async def test_a_large_plan_is_checked_like_any_other(service: Service, large_plan: dict[str, Any]) -> None:
    good = await check(service, large_plan)
    visited = {entry["item_id"] for entry in good["timeline"]["entries"]}
    assert visited == {item["id"] for item in large_plan["items"]}
    assert not any(finding["severity"] == "error" for finding in good["findings"])
    assert (await check(service, large_plan, vehicle=service.v1))["parameters_age_s"] == 2.5
    large_plan["items"][7]["latitude_deg"] = 91
    for options in ({}, {"vehicle": service.v1}):
        bad = await check(service, large_plan, **options)
        assert (bad["timeline"], [one["pointer"] for one in bad["findings"]]) == (None, ["/items/7/latitude_deg"])


async def test_a_stored_large_plan_is_shown_as_it_was_checked(service: Service, large_plan: dict[str, Any]) -> None:
    found = await check(service, large_plan)
    status, headers, made = await service.call("POST", "/api/v1/plans", json=large_plan)
    assert status == 201
    assert (made["findings"], made["timeline"]) == (found["findings"], found["timeline"])
    assert (await service.call("GET", headers["Location"]))[2] == made


async def test_a_large_plan_is_exported_whole(service: Service, large_plan: dict[str, Any]) -> None:
    _, headers, _ = await service.call("POST", "/api/v1/plans", json=large_plan)
    status, _, exported = await service.call("GET", f"{headers['Location']}/exports/geojson")
    assert status == 200
    assert len(exported["features"]) >= len(large_plan["items"]) - 2, "takeoff and return have no place of their own"


async def test_checks_are_answered_while_the_worker_is_killed(service: Service, large_plan: dict[str, Any]) -> None:
    expected = await check(service, large_plan)
    checks = [asyncio.create_task(check(service, large_plan)) for _ in range(12)]
    kills = 0
    while not all(task.done() for task in checks):
        for pid in workers_of(os.getpid()):
            os.kill(pid, signal.SIGKILL)
            kills += 1
        await asyncio.sleep(0.05)
    assert [await task == expected for task in checks] == [True] * 12
    assert kills
