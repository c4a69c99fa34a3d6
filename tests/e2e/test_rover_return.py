"""A simulated rover whose return is paused and repeated: PX4 moves its home to where a return begins."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import aiohttp

from app.domain.geo import distance_m
from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet


def _away_m(place: dict[str, Any], home: dict[str, Any]) -> float:
    return distance_m(place["latitude_deg"], place["longitude_deg"], home["latitude_deg"], home["longitude_deg"])


async def test_a_rover_that_is_paused_on_its_return_and_returns_again_comes_home(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with (
        SimulatedFleet("rover") as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        run_id = await dispatcher.fly(json.loads((PLANS / "rover-drop.json").read_text()), "v1")

        async def state() -> dict[str, Any]:
            return dict((await dispatcher.get("/vehicles/v1"))["state"])

        took_off = (await state())["home"]
        await until(state, lambda now: _away_m(now, took_off) > 20.0, "it must drive away", 60.0)
        await dispatcher.post(f"/runs/{run_id}/pause")
        await dispatcher.post(f"/runs/{run_id}/return")
        await until(state, lambda now: _away_m(now["home"], took_off) > 15.0, "PX4 moves its home", 10.0)
        await dispatcher.post(f"/runs/{run_id}/pause")
        await dispatcher.post(f"/runs/{run_id}/return")
        ended = await dispatcher.until_over(run_id, 60.0)
        assert (ended["state"], ended["reason"]["code"]) == ("aborted", "run.asked_before_done")
        assert _away_m(ended["last_position"], took_off) < 12.0
