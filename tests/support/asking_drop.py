"""An operator's consent over REST: the first answer counts, and each refusal of an answer has its code."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from tests.support.runs_api import create, reaches
from tests.support.service_in_process import LOOK_AGAIN_S, Service


@pytest.fixture
async def run_id(service: Service, plan: dict[str, Any]) -> str:
    """A run in flight whose drop needs consent and has not asked yet."""
    return await flying_to_consent(service, plan)


async def flying_to_consent(service: Service, plan: dict[str, Any]) -> str:
    """A run in flight whose drop needs consent and has not asked yet."""
    drop = next(item for item in plan["items"] if item["type"] == "gripper")
    drop["consent"] = "operator"
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    run = await create(service, made["id"], start=True)
    await reaches(service, run["id"], "flying")
    return str(run["id"])


async def asked(service: Service, plan: dict[str, Any], run_id: str) -> dict[str, Any]:
    """Fly to the drop; the consent's record once it is asked."""
    clinic = next(item for item in plan["items"] if item["id"] == "clinic")
    link, place = service.links[0], {"longitude_deg": clinic["longitude_deg"], "boot_time_s": 100.0}
    link.change(mission_seq=2, latitude_deg=clinic["latitude_deg"] - 0.0001, **place)
    await until_run(service, run_id, lambda run: run["item_id"] == "clinic")
    link.change(latitude_deg=clinic["latitude_deg"], **place)
    run = await until_run(service, run_id, lambda run: run["drops"][0]["consent"]["state"] == "asked")
    return dict(run["drops"][0]["consent"])


async def until_run(service: Service, run_id: str, holds: Any) -> Any:
    async with asyncio.timeout(15):
        while True:
            _, _, run = await service.call("GET", f"/api/v1/runs/{run_id}")
            if holds(run):
                return run
            await asyncio.sleep(LOOK_AGAIN_S)
