"""A picture that the plan asks for at its stop is named by the drop's evidence."""

from __future__ import annotations

import json
from pathlib import Path

import aiohttp
import pytest

from app.domain.geo import distance_m
from tests.support.forked_service import ForkedService
from tests.support.paths import ROOT
from tests.support.patient_drops import patient
from tests.support.service_process import Dispatcher
from tests.support.simulated import SimulatedFleet


@pytest.mark.parametrize("mode", ["supervised", "embedded"])
async def test_a_photo_after_the_drop_is_named_by_its_delivery_report(
    tmp_path: Path, http: aiohttp.ClientSession, mode: str
) -> None:
    plan = json.loads((ROOT / "plans" / "clinic-run.json").read_text())
    (index,) = [number for number, item in enumerate(plan["items"]) if item["type"] == "gripper"]
    plan["items"][index]["mode"] = mode
    plan = patient(plan)
    plan["items"].insert(index + 1, {"type": "photo", "id": "picture"})
    with (
        SimulatedFleet("quad:camera=1", speed=4.0) as fleet,
        ForkedService(tmp_path, fleet.connections) as service,
    ):
        at = Dispatcher(http, service.url)
        await at.until_vehicles(1, 180.0)
        run = await at.until_over(await at.fly(plan, "v1"), 300.0)
        assert run["state"] == "completed", run["reason"]
        report = await at.get(f"/runs/{run['id']}/delivery-report")
        (drop,) = report["drops"]
        (picture,) = drop["pictures"]
        assert picture["captured"] is True
        assert picture["url"].startswith("mavlinkftp:")
        async with http.get(f"{service.url}/api/v1/runs/{run['id']}/delivery-report.html") as sheet:
            assert picture["url"] in await sheet.text()
        there = (drop["planned_latitude_deg"], drop["planned_longitude_deg"])
        assert distance_m(*there, picture["latitude_deg"], picture["longitude_deg"]) < 3.0
