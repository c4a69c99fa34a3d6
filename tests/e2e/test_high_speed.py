"""At 50 times real time: an embedded drop ends as it should, through the whole service; a supervised one is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet

EMBEDDED, SUPERVISED = (
    json.loads((PLANS / name).read_text()) for name in ("multicopter-embedded.json", "clinic-run.json")
)
WITHIN_S = 60.0


async def test_an_embedded_mission_flies_as_predicted_and_a_supervised_one_is_refused(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with SimulatedFleet("quad", speed=50.0) as simulated:
        assert "Supervised drops and OFFBOARD work up to 4x" in simulated.output()
        control = f"127.0.0.1:{simulated.control_port}"
        with ForkedService(tmp_path, simulated.connections, WAYDROP_SIMULATOR_CONTROL=control) as service:
            dispatcher = Dispatcher(http, service.url)
            await dispatcher.until_vehicles(1)
            await until(
                lambda: refusal(dispatcher), lambda code: code == "vehicle.clock_too_fast", "it is refused", WITHIN_S
            )
            made = await dispatcher.post("/plans", EMBEDDED)
            run = await dispatcher.post("/runs", {"plan": made["id"], "vehicle": "v1", "start": True})
            run = await dispatcher.until_over(run["id"], WITHIN_S)
            assert (run["state"], run["reason"]) == ("completed", None), service.log()
            assert [drop["outcome"] for drop in run["drops"]] == ["released"]
            assert run["flown_item_ids"] == made["timeline"]["order"]
            view = await until(lambda: dispatcher.get("/simulator"), has_answered, "the simulator answers", WITHIN_S)
            truth = view["vehicles"][0]
            assert (truth["landed_state"], truth["armed"], truth["gripper_open"]) == ("ON_GROUND", False, True)


def has_answered(view: dict[str, Any]) -> bool:
    """On a busy machine the simulator may be silent for longer than it is listened to."""
    return bool(view["available"])


async def refusal(dispatcher: Dispatcher) -> Any:
    """The first error against the supervised plan: none until the vehicle's clock has been listened to for a second."""
    checked = await dispatcher.post("/plan-checks", {"plan": SUPERVISED, "vehicle": "v1"})
    return next((finding["code"] for finding in checked["findings"] if finding["severity"] == "error"), None)
