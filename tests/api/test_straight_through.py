"""A posted plan goes straight through: it is parsed once, and each check of it predicts its flight once."""

from __future__ import annotations

import importlib
import json
from collections import Counter
from typing import Any

import pytest

from app.domain.plan import Plan
from tests.support.paths import PLANS
from tests.support.runs_api import create, reaches
from tests.support.service_in_process import Service

WITH_ALTERNATE = PLANS / "multicopter-alternate.json"


@pytest.fixture
def times(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often a whole plan was validated, and a flight was predicted."""
    counted: Counter[str] = Counter()

    def count(owner: object, name: str, what: str) -> None:
        real = getattr(owner, name)

        def counting(*args: Any, **more: Any) -> Any:
            counted[what] += 1
            return real(*args, **more)

        monkeypatch.setattr(owner, name, counting)

    count(Plan, "model_validate", "parsed")
    count(Plan, "model_validate_json", "parsed")
    count(importlib.import_module("app.domain.prediction.predict"), "flight_of", "predicted")
    return counted


async def test_a_posted_plan_is_parsed_once_whatever_is_done_with_it(
    service: Service, plan: dict[str, Any], times: Counter[str]
) -> None:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    run = await create(service, made["id"])
    await reaches(service, run["id"], "uploaded")
    await service.call("POST", f"/api/v1/runs/{run['id']}/start")
    await reaches(service, run["id"], "flying")
    await service.call("GET", f"/api/v1/plans/{made['id']}")
    assert times["parsed"] == 1


async def test_a_plan_in_an_order_is_parsed_once(service: Service, plan: dict[str, Any], times: Counter[str]) -> None:
    status, _, _ = await service.call("POST", "/api/v1/jobs", json={"plan": plan, "vehicle": "any"})
    assert (status, times["parsed"]) == (202, 1)


async def test_each_check_predicts_once(service: Service, plan: dict[str, Any], times: Counter[str]) -> None:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    assert times["predicted"] == 1
    await service.call("POST", "/api/v1/plan-checks", json={"plan": plan, "vehicle": "v1"})
    assert times["predicted"] == 2
    run = await create(service, made["id"])
    await reaches(service, run["id"], "uploaded")
    assert times["predicted"] == 3


async def test_the_way_over_the_alternates_is_one_flight_more(service: Service, times: Counter[str]) -> None:
    await service.call("POST", "/api/v1/plan-checks", json={"plan": json.loads(WITH_ALTERNATE.read_text())})
    assert (times["parsed"], times["predicted"]) == (1, 2)
