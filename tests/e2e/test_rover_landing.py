"""A simulated rover that is landed by command on its way: it stops, and its run tells of nobody else."""

from __future__ import annotations

import json
from pathlib import Path

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet


async def test_a_rover_that_is_landed_as_it_drives_stands_before_it_is_switched_off(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with (
        SimulatedFleet("rover") as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        run_id = await dispatcher.fly(json.loads((PLANS / "rover-drop.json").read_text()), "v1")

        async def speed_m_s() -> float:
            state = (await dispatcher.get("/vehicles/v1"))["state"]
            return float(abs(state["velocity_north_m_s"] or 0.0) + abs(state["velocity_east_m_s"] or 0.0))

        await until(speed_m_s, lambda speed: speed > 1.5, "it must drive", 60.0)
        await dispatcher.post(f"/runs/{run_id}/land")
        assert await speed_m_s() < 0.3, "Land is sent once it stands"
        ended = await dispatcher.until_over(run_id, 30.0)
        assert (ended["state"], ended["reason"]["code"]) == ("aborted", "run.asked_before_done")
