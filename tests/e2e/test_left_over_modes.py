"""A run flies its vehicle in whatever mode that was left in: by a pilot, another ground station, or by Waydrop."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from tests.support.forked_service import ForkedService
from tests.support.offboard_client import Pilot, paused_in_the_air, truth
from tests.support.offboard_flights import GAP_S, LATE_FAILSAFE, fly_offboard
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet

TYPES = {
    "quad": "multicopter-embedded.json",
    "plane": "fixed-wing-pass.json",
    "vtol": "vtol-hover-drop.json",
    "rover": "rover-drop.json",
}
MODES = (
    *("OFFBOARD", "POSCTL", "MANUAL", "ALTCTL", "STABILIZED", "ACRO", "RTL", "LAND"),
    *("LOITER", "MISSION", "TAKEOFF", "ORBIT"),
)
FAST = 4.0
"""Supervised drops, and OFFBOARD, need no more."""


def _plan(airframe: str) -> Any:
    return json.loads((PLANS / TYPES[airframe]).read_text())


async def test_a_run_started_in_each_left_over_mode_flies_on_the_simulated_vehicles_of_all_types(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    """Each is left as a pilot or another ground station would; a reboot puts it back to the start."""
    with (
        SimulatedFleet(",".join(TYPES), speed=FAST) as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(len(TYPES))
        stored = [(await dispatcher.post("/plans", _plan(airframe)))["id"] for airframe in TYPES]
        grounded = []
        for mode in MODES:
            simulated.control("mode", mode)
            starts = (_started(dispatcher, plan, f"v{number}", mode) for number, plan in enumerate(stored, start=1))
            grounded += [said for said in await asyncio.gather(*starts) if said]
            simulated.control("reboot", True)
            for number in range(1, len(TYPES) + 1):
                await _until_vehicle(dispatcher, f"v{number}", _stands, "it must stand at its start again")
        log = service.log()
    assert not grounded, "\n".join([*grounded, log])


async def _started(dispatcher: Dispatcher, plan_id: str, vehicle_id: str, mode: str) -> str:
    """What keeps it on the ground; empty if it flies its mission."""
    run = await dispatcher.post("/runs", {"plan": plan_id, "vehicle": vehicle_id, "start": True})
    begun = ("flying", "at_drop", "failed", "completed")
    run = await dispatcher.until_run(run["id"], lambda now: now["state"] in begun, "the start must end", 90.0)
    if run["state"] == "failed":
        return f"{vehicle_id} left in {mode}: {run['reason']}"
    await _until_vehicle(
        dispatcher, vehicle_id, lambda now: now["armed"] and now["mode"] == "mission", "it must fly its mission"
    )
    return ""


async def test_a_rover_drives_one_delivery_after_the_other(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    """It stays armed where its plan ends, as PX4's does: its run disarms it, so that the next one can start."""
    with (
        SimulatedFleet("rover", speed=10.0) as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        plan = (await dispatcher.post("/plans", _plan("rover")))["id"]
        for _ in range(2):
            run = await dispatcher.post("/runs", {"plan": plan, "vehicle": "v1", "start": True})
            run = await dispatcher.until_run(run["id"], lambda now: now["ended_at"] is not None, "it must end", 90.0)
            assert run["state"] == "completed", run["reason"]
            vehicle = await dispatcher.get("/vehicles/v1")
            assert vehicle["state"]["armed"] is False


def _stands(state: Any) -> bool:
    return state["connected"] and state["armed"] is False and state["landed"] == "on_ground"


async def _until_vehicle(dispatcher: Dispatcher, vehicle_id: str, what: Any, promise: str) -> None:
    async def look() -> Any:
        vehicle = await dispatcher.get(f"/vehicles/{vehicle_id}")
        return vehicle["state"] | {"run_id": vehicle["run_id"]}

    free = "again" in promise
    await until(look, lambda now: what(now) and (not free or now["run_id"] is None), f"{vehicle_id}: {promise}", 60.0)


@pytest.mark.parametrize("way", ["leave to return", "return", "land", "killed, return"])
async def test_after_manual_control_the_vehicle_comes_home_and_flies_again(
    way: str, tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    """Recordings 26, 26b: a return out of OFFBOARD ended disarmed in OFFBOARD, and nothing got the vehicle out."""
    with (
        SimulatedFleet("quad", speed=FAST, params=f"COM_OBL_RC_ACT=5,{LATE_FAILSAFE}") as simulated,
        ForkedService(tmp_path, simulated.connections, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        run_id = await paused_in_the_air(dispatcher)

        async def end(ann: Pilot) -> None:
            if way == "leave to return":
                assert (await ann.do("leave", to="return"))["type"] == "done"
            elif way == "killed, return":
                service.kill()
                await until(lambda: truth(simulated), lambda v: v["mode"] == "LOITER", "its failsafe must act", 30.0)
            else:
                await dispatcher.post(f"/runs/{run_id}/{way}")
                await ann.until_closed()
                assert ann.offboard["reason"]["params"] == {"command": way}

        await fly_offboard(http, service, run_id, end)
        if way == "killed, return":
            service.start()
            await dispatcher.until_vehicles(1)
            await _until_vehicle(dispatcher, "v1", lambda now: now["run_id"] == run_id, "its run must be taken up")
            await dispatcher.post(f"/runs/{run_id}/return")
        assert (await dispatcher.until_over(run_id, 90.0))["state"] == "aborted"
        landed = await truth(simulated)
        assert (landed["armed"], landed["mode"]) == (False, "LOITER")
        again = await dispatcher.fly(_plan("quad"), "v1")
        await dispatcher.until_run(again, lambda run: run["state"] == "flying", "it must fly again", 60.0)


async def test_a_vehicle_that_was_left_in_offboard_is_told_to_hold_on_the_ground(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with (
        SimulatedFleet("quad", speed=FAST) as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        simulated.control("mode", "OFFBOARD")
        held = await dispatcher.post("/vehicles/v1/hold", expect=202)
        assert (held["state"]["mode"], held["state"]["armed"]) == ("hold", False)
        assert (await truth(simulated))["mode"] == "LOITER"
