"""Large bodies: read in a thread, and refused before each of their faults is named, for everything waits meanwhile."""

from __future__ import annotations

import json
from typing import Any

import pytest

from app.api.bodies import SMALL_BYTES
from tests.support.service_in_process import Service

MANY_FIELDS = {f"k{number}": 0 for number in range(20_000)}


@pytest.mark.parametrize("path", ["runs", "runs/nix/inserted-items", "webhooks", "vehicles/v1/tasks"])
async def test_a_body_without_a_plan_in_it_is_small(service: Service, path: str) -> None:
    status, _, problem = await service.call("POST", f"/api/v1/{path}", json=MANY_FIELDS)
    assert (status, problem["code"]) == (413, "request.too_large")
    assert str(SMALL_BYTES) in problem["detail"]


@pytest.mark.parametrize("path", ["plan-checks", "jobs", "job-checks"])
async def test_a_body_with_a_plan_in_it_has_as_many_fields_as_such_a_body_can_have(service: Service, path: str) -> None:
    status, _, problem = await service.call("POST", f"/api/v1/{path}", json={"plan": {}, **MANY_FIELDS})
    assert (status, problem["code"]) == (422, "request.invalid")
    assert "20001 fields" in problem["detail"]


@pytest.mark.parametrize("path", ["plan-checks", "jobs", "job-checks"])
async def test_so_has_each_part_of_it_but_the_plan(service: Service, path: str) -> None:
    status, _, problem = await service.call("POST", f"/api/v1/{path}", json={"plan": "p", "wind": MANY_FIELDS})
    assert (status, problem["code"]) == (422, "request.invalid")
    assert [(one["code"], one["pointer"]) for one in problem["findings"]] == [("body.too_long", "/wind")]


@pytest.mark.parametrize(
    ("method", "path", "wrap"),
    [("POST", "plans", False), ("POST", "plan-checks", True), ("POST", "jobs", True)],
)
async def test_a_large_plan_that_is_none_is_refused_with_a_hundred_findings(
    service: Service, method: str, path: str, wrap: bool
) -> None:
    document: Any = {"version": 1, **MANY_FIELDS}
    _, _, told = await service.call(method, f"/api/v1/{path}", json={"plan": document} if wrap else document)
    assert len(told["findings"]) == 100, json.dumps(told)[:300]
    assert told["findings"][0] == {
        "code": "plan.unknown_field",
        "severity": "error",
        "pointer": "/k0",
        "message": "unknown field 'k0'",
        "item_id": None,
        "hint": "remove it, or see `waydrop schema`",
        "assumed": [],
    }
