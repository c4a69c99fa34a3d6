"""A delivery that is moved, and given one more stop, while the vehicle flies to it: over UDP, without a pause."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import aiohttp

from app.domain.geo import distance_m
from app.storage.verify import verify_journal
from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.patient_drops import patient
from tests.support.service_process import Dispatcher
from tests.support.simulated import SimulatedFleet

PLAN: dict[str, Any] = patient(json.loads((PLANS / "clinic-run.json").read_text()))
PLAN["items"][1]["hold_s"] = 600.0  # at `corner`: a busy machine has time for both changes, and the second one ends it
MOVED = {"latitude_deg": 47.398691, "longitude_deg": 8.546756}
STOP = {"id": "look", "type": "waypoint", "latitude_deg": 47.3985, "longitude_deg": 8.5472, "relative_altitude_m": 20}
WITHIN_S, FOUND_S = 300.0, 180.0


async def test_a_delivery_is_moved_in_flight_and_made_at_its_new_place(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with SimulatedFleet("quad", speed=4.0) as simulated, ForkedService(tmp_path, simulated.connections) as service:
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1, FOUND_S)
        run_id = await dispatcher.fly(PLAN, "v1")
        await dispatcher.until_run(run_id, lambda run: run["item_id"] == "corner", "it takes off", WITHIN_S)
        run = await dispatcher.post(f"/runs/{run_id}/inserted-items", {"items": [STOP], "after": "clinic"})
        assert (run["state"], run["changes"], run["change"]["continue_at"]) == ("flying", 1, "corner"), service.log()
        changed = (await dispatcher.get(f"/plans/{run['plan_id']}"))["plan"]
        corner, clinic = changed["items"][1:3]
        clinic.update(MOVED)
        del corner["hold_s"]
        plan = await dispatcher.post("/plans", changed)
        run = await dispatcher.post(f"/runs/{run_id}/mission", {"plan": plan["id"]})
        assert (run["state"], run["changes"], run["change"]["continue_at"]) == ("flying", 2, "corner"), service.log()
        run = await dispatcher.until_over(run_id, WITHIN_S)
        assert (run["state"], run["reason"]) == ("completed", None), service.log()
        assert run["flown_item_ids"] == ["takeoff", "corner", "clinic", "drop", "look", "home"]
        drop = run["drops"][0]
        away_m = distance_m(drop["latitude_deg"], drop["longitude_deg"], *MOVED.values())
        assert (drop["outcome"], drop["attempts"], away_m < 2.0) == ("released", 1, True)
        comparison = await dispatcher.get(f"/runs/{run_id}/comparison")
        compared = [item["item_id"] for item in comparison["items"] if item["flown_s"] is not None]
        assert compared == run["flown_item_ids"]
        report = await dispatcher.get(f"/runs/{run_id}/delivery-report")
        assert (len(report["earlier_plans"]), report["plan"]["is_as_flown"]) == (2, True)
    assert (await verify_journal(tmp_path / "waydrop.db")).alterations == []
