"""What the answer to an order of a job says at once: that waiting mends nothing; and the wind that counts for it."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta

import pytest

from tests.support.job_plans import job_of, queue, until_job
from tests.support.jobs_api import stop
from tests.support.paths import PLANS
from tests.support.service_in_process import Service


async def test_a_job_that_no_vehicle_can_ever_fly_says_so_at_once_and_waits_all_the_same(service: Service) -> None:
    wing = json.loads((PLANS / "fixed-wing-pass.json").read_text())
    status, _, job = await service.call("POST", "/api/v1/jobs", json={"plan": wing})
    assert (status, job["state"]) == (202, "queued")
    assert "no vehicle can fly it as it is" in job["warning"]
    assert "v1: " in job["warning"]
    assert all(one["permanent"] for one in job["candidates"])
    _, _, told = await service.call("POST", "/api/v1/job-checks", json={"plan": wing})
    assert told["warning"] == job["warning"]
    assert (await job_of(service, job["id"]))["warning"] == job["warning"]
    await stop(service)
    await stop(service, "v2")
    assert (await queue(service))["warning"] == "", "these queues may go on"


async def test_the_wind_of_a_job_is_that_of_its_run(service: Service) -> None:
    job = await queue(service, wind={"from_deg": 0, "speed_m_s": 5})
    assert job["wind"] == {"north_m_s": pytest.approx(-5.0), "east_m_s": pytest.approx(0.0, abs=1e-6), "given": True}
    job = await until_job(service, job["id"], "prepared")
    _, _, run = await service.call("GET", f"/api/v1/runs/{job['run_id']}")
    assert run["wind"] == job["wind"]
    assert (await queue(service, expect=422, wind={"from_deg": 0}))["code"] == "request.invalid"


@pytest.mark.parametrize("field", ["not_before", "deadline"])
@pytest.mark.parametrize("path", ["/api/v1/jobs", "/api/v1/job-checks"])
@pytest.mark.parametrize("time", ["9999-12-31T23:59:59-12:00", "2099-01-01T00:00:00Z", 19_000_000_000])
async def test_a_time_that_is_too_far_ahead_is_refused_with_its_place(
    service: Service, field: str, path: str, time: str | int
) -> None:
    status, _, problem = await service.call("POST", path, json={"plan": "plan-1", field: time})
    assert (status, problem["code"]) == (422, "request.invalid")
    (finding,) = problem["findings"]
    assert finding["pointer"] == f"/{field}"
    assert "at most ten years ahead" in finding["hint"]


async def test_a_time_of_some_years_ahead_is_taken(service: Service) -> None:
    later = datetime.now(UTC) + timedelta(days=3000)
    job = await queue(service, not_before=later.isoformat(), deadline=(later + timedelta(days=1)).isoformat())
    assert job["not_before"] == later.timestamp()
