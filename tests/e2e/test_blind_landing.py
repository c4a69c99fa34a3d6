"""A simulated vehicle that comes down without a position, above home: no return and no landing of its plan."""

from __future__ import annotations

import json
from pathlib import Path

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet


async def test_a_blind_descent_above_home_is_no_landing_at_home(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    with (
        SimulatedFleet("quad") as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        run_id = await dispatcher.fly(json.loads((PLANS / "multicopter-embedded.json").read_text()), "v1")

        async def state() -> dict[str, object]:
            return dict((await dispatcher.get("/vehicles/v1"))["state"])

        await until(state, lambda it: it["landed"] != "on_ground", "it must take off", 60.0)
        simulated.control("gps_loss", True)
        shown = await until(state, lambda it: it["mode"] == "descend", "it must come down blindly", 60.0)
        assert shown["in_failsafe"]

        async def told() -> tuple[str, str | None]:
            run = await dispatcher.get(f"/runs/{run_id}")
            return run["state"], run["reason"] and run["reason"]["code"]

        await until(told, lambda it: it == ("returning", "run.failsafe_mode"), "the run must say so", 20.0)
        ended = await dispatcher.until_over(run_id, 120.0)
        assert (ended["state"], ended["reason"]["code"]) == ("failed", "run.landed_elsewhere")
        assert ended["reason"]["cause"]["code"] == "run.failsafe_mode"
