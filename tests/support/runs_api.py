"""Runs over REST."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from tests.support.service_in_process import LOOK_AGAIN_S, Service


@pytest.fixture
async def plan_id(service: Service, plan: dict[str, Any]) -> str:
    """A stored plan."""
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    return str(made["id"])


async def create(service: Service, plan_id: str, vehicle_id: str | None = None, **more: Any) -> dict[str, Any]:
    """A run."""
    status, headers, run = await service.call(
        "POST", "/api/v1/runs", json={"plan": plan_id, "vehicle": vehicle_id or service.v1, **more}
    )
    assert status == 202
    assert headers["Location"] == f"/api/v1/runs/{run['id']}"
    return dict(run)


async def reaches(service: Service, run_id: str, *states: str) -> dict[str, Any]:
    """Wait for one of these states."""
    async with asyncio.timeout(60):
        while True:
            status, _, run = await service.call("GET", f"/api/v1/runs/{run_id}")
            assert status == 200, run
            if run["state"] in states:
                return dict(run)
            await asyncio.sleep(LOOK_AGAIN_S)
