"""A NUL character, which PostgreSQL stores nowhere, is refused before it costs anybody an answer or an audit entry."""

from __future__ import annotations

import asyncio
import json
import re
from typing import Any

import pytest

from app.api.application import ROUTES
from app.api.bodies import NUL_IN_JSON
from tests.support.paths import PLANS
from tests.support.service_in_process import Service

SOON_S = 20.0
PATHS = sorted({(route.method, re.sub(r"{[^}]+}", "a%00", route.path)) for route in ROUTES if "{" in route.path})


async def test_no_path_with_one_is_an_error_of_the_service(service: Service) -> None:
    told = {}
    for method, path in PATHS:
        status, _, answer = await service.call(method, path)
        if status >= 500:
            told[f"{method} {path}"] = status, answer
    assert told == {}


@pytest.mark.parametrize("path", ["jobs/%00", "runs/run%00", "plans/%00", "runs/%00/comparison"])
async def test_a_resource_with_one_is_not_found(service: Service, path: str) -> None:
    status, _, problem = await service.call("GET", f"/api/v1/{path}")
    assert (status, problem["code"]) == (404, "resource.not_found")


@pytest.mark.parametrize("path", ["runs?vehicle=%00", "runs?plan=a%00", "jobs?vehicle=%00", "audit?actor=%00"])
async def test_a_query_with_one_is_refused(service: Service, path: str) -> None:
    status, _, problem = await service.call("GET", f"/api/v1/{path}")
    assert (status, problem["code"]) == (400, "request.query_invalid"), problem
    assert "NUL character" in problem["detail"]


@pytest.mark.parametrize("body", [{"plan": "plan-1\0", "vehicle": "v1"}, {"plan": "plan-1", "vehicle": "v1\0"}])
@pytest.mark.parametrize("path", ["runs", "jobs"])
async def test_a_body_with_one_is_refused(service: Service, path: str, body: dict[str, Any]) -> None:
    status, _, problem = await service.call("POST", f"/api/v1/{path}", json=body)
    assert (status, problem["code"]) == (422, "request.invalid"), problem
    assert "NUL character" in problem["detail"]


async def test_a_plan_with_one_is_refused(service: Service) -> None:
    plan = json.loads((PLANS / "clinic-run.json").read_text()) | {"name": "Clinic\0"}
    status, _, problem = await service.call("POST", "/api/v1/plans", json=plan)
    assert (status, problem["code"]) == (422, "plan.invalid"), problem


async def test_one_in_a_path_costs_nobody_an_audit_entry(service: Service) -> None:
    for path in ("runs/run-before/start", "jobs/job%00/cancel", "runs/run-after/start"):
        await service.call("POST", f"/api/v1/{path}", json={})
    wanted = ["/api/v1/jobs/job%00/cancel", "/api/v1/runs/run-after/start", "/api/v1/runs/run-before/start"]
    async with asyncio.timeout(SOON_S):
        while True:
            _, _, page = await service.call("GET", "/api/v1/audit?limit=100")
            if sorted(entry["target"] for entry in page["entries"]) == wanted:
                return
            await asyncio.sleep(0.05)


@pytest.mark.parametrize(
    ("text", "has_one"),
    [("\0", True), ("a\0b", True), ("\\u0000", False), ("\\\0", True), ("\\\\u0000", False), ("", False)],
)
def test_an_escaped_one_is_found_in_json_and_nothing_else(text: str, has_one: bool) -> None:
    assert (NUL_IN_JSON.search(json.dumps({"text": text}).encode()) is not None) is has_one
