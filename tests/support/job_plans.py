"""Jobs for tests of the API: a plan without drops, and vehicles that fly it in a moment."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from app.domain.vehicle.state import FlightMode, LandedState, MissionState
from tests.support.service_in_process import LOOK_AGAIN_S, Service

LAST_SEQ = 2
ROUTE: dict[str, Any] = {
    "version": 1,
    "name": "a round",
    "vehicle_type": "multicopter",
    "order": {"id": "RX-7"},
    "home": {"latitude_deg": 47.397742, "longitude_deg": 8.545594, "absolute_altitude_m": 488.0},
    "items": [
        {"id": "takeoff", "type": "takeoff", "relative_altitude_m": 15},
        {
            "id": "far",
            "type": "waypoint",
            "latitude_deg": 47.398282,
            "longitude_deg": 8.545594,
            "relative_altitude_m": 15,
        },
        {"id": "home", "type": "return_to_launch"},
    ],
}


async def queue(service: Service, *, expect: int = 202, headers: Any = None, **fields: Any) -> dict[str, Any]:
    """POST a job of the route."""
    body = {"plan": ROUTE, **fields}
    status, told, job = await service.call("POST", "/api/v1/jobs", json=body, headers=headers)
    assert status == expect, job
    if expect == 202:
        assert told["Location"] == f"/api/v1/jobs/{job['id']}"
    return dict(job)


async def job_of(service: Service, job_id: str) -> dict[str, Any]:
    """GET a job."""
    status, _, job = await service.call("GET", f"/api/v1/jobs/{job_id}")
    assert status == 200, job
    return dict(job)


async def until_job(
    service: Service, job_id: str, *states: str, and_so: Callable[[dict[str, Any]], bool] = lambda job: True
) -> dict[str, Any]:
    """Wait until a job is in one of these states."""
    job: dict[str, Any] = {}
    try:
        async with asyncio.timeout(20):
            while True:
                job = await job_of(service, job_id)
                if job["state"] in states and and_so(job):
                    return job
                await asyncio.sleep(LOOK_AGAIN_S)
    except TimeoutError:
        raise AssertionError(f"the job must become {states}; it is {job}") from None


async def start(service: Service, job: dict[str, Any]) -> None:
    """What a person does with a prepared job."""
    status, _, _ = await service.call("POST", f"/api/v1/runs/{job['run_id']}/start")
    assert status == 202


async def fly_home(service: Service, number: int = 1) -> None:
    """The whole mission of a vehicle that flies its job, to the landing and the disarming."""
    link, vehicle = service.links[number - 1], service.services.fleet.view(service.vehicle_id(number))
    assert vehicle.run_id is not None
    link.change(mission_seq=LAST_SEQ)
    async with asyncio.timeout(20):
        while (await service.services.runs.get(vehicle.run_id)).item_id != "home":
            await asyncio.sleep(0.01)
    link.change(mission_state=MissionState.COMPLETE, mode=FlightMode.RETURN)
    link.change(armed=False, landed=LandedState.ON_GROUND, relative_altitude_m=0.0)


def codes(job: dict[str, Any], vehicle_id: str) -> list[str]:
    """The codes of what speaks against a vehicle."""
    (candidate,) = (one for one in job["candidates"] if one["vehicle_id"] == vehicle_id)
    return [refusal["code"] for refusal in candidate["refusals"]]
