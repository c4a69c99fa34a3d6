"""Two jobs for any vehicle of a fleet of two: each vehicle gets one, both fly at once, and both are told as done."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet

PLAN = json.loads((PLANS / "multicopter-embedded.json").read_text())
WITHIN_S = 120.0
ORDERED_S = timedelta(seconds=5)
"""Both are there before either starts: else one that came late might be given to a vehicle that is back already."""


async def test_two_jobs_for_any_vehicle_are_flown_by_two(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    with (
        SimulatedFleet("quad,quad", speed=20.0) as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(2)
        order = {"plan": PLAN, "vehicle": "any", "auto_start": True}
        await until(
            lambda: able(dispatcher, order), lambda names: len(names) == 2, "both vehicles can have it", WITHIN_S
        )
        later = {**order, "not_before": (datetime.now(UTC) + ORDERED_S).isoformat()}
        made = [await dispatcher.post("/jobs", later, expect=202) for _ in range(2)]
        jobs = [
            await until(lambda job=job: dispatcher.get(f"/jobs/{job['id']}"), is_over, "the job must end", WITHIN_S)
            for job in made
        ]
        assert [job["state"] for job in jobs] == ["completed", "completed"], [job["reason"] for job in jobs]
        assert sorted(job["vehicle_id"] for job in jobs) == ["v1", "v2"]
        chosen = [[one["vehicle_id"] for one in job["candidates"] if one["chosen"]] for job in jobs]
        assert chosen == [[job["vehicle_id"]] for job in jobs]
        for job in jobs:
            run = await dispatcher.get(f"/runs/{job['run_id']}")
            assert [drop["outcome"] for drop in run["drops"]] == ["released"]


async def able(dispatcher: Dispatcher, order: dict[str, Any]) -> list[str]:
    """The vehicles that nothing speaks against."""
    checked = await dispatcher.post("/job-checks", order)
    return [one["vehicle_id"] for one in checked["candidates"] if not one["refusals"]]


def is_over(job: Any) -> bool:
    """Whether nothing follows."""
    return job["ended_at"] is not None
