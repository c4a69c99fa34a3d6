"""Data goes straight through: a plan is parsed once and predicted once for each check, a setpoint encoded once."""

from __future__ import annotations

import importlib
import json
from collections import Counter
from typing import Any

import pytest

from app.domain.offboard.encode import Follower, encode
from app.domain.offboard.messages import SetpointMessage
from app.domain.offboard.setpoints import ZERO_VELOCITY, Setpoint
from app.domain.plan import Plan
from app.vehicles.encoders import SetpointOut, setpoint_json
from tests.support.fake_links import FakeLink
from tests.support.offboard_api import NORTH, link
from tests.support.offboard_socket import pilot
from tests.support.paths import PLANS
from tests.support.runs_api import create, reaches
from tests.support.service_in_process import Service, until

__all__ = ["link"]

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


@pytest.mark.parametrize("north_m_s", [2.0, 80.0], ids=["as it is", "clamped"])
async def test_a_setpoint_is_encoded_once_though_every_tick_sends_it(
    service: Service, link: FakeLink, monkeypatch: pytest.MonkeyPatch, north_m_s: float
) -> None:
    encoded: list[Setpoint] = []
    on_the_wire: list[str] = []

    def encode_counting(setpoint: Setpoint, follower: Follower) -> SetpointMessage:
        if setpoint != ZERO_VELOCITY:  # the dead-man's, before the first one
            encoded.append(setpoint)
        return encode(setpoint, follower)

    def send(message: SetpointMessage) -> None:
        on_the_wire.append(SetpointOut(message).fields_json(1, 1))

    monkeypatch.setattr("app.services.offboard.stream.encode", encode_counting)
    async with pilot(service) as ann:
        await ann.send("acquire_lease", rate_hz=50)
        await ann.send("enter")
        await ann.send("setpoint", setpoint={**NORTH, "north_m_s": north_m_s})
        setpoint_json.cache_clear()
        monkeypatch.setattr(link, "send_setpoint", send)
        await until(lambda: len(on_the_wire) >= 10)
        assert (len(encoded), len({*on_the_wire}), setpoint_json.cache_info().misses) == (1, 1, 1)
