"""A person takes a vehicle out of its run and flies it; whatever dies, nothing of ours moves the vehicle."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from pathlib import Path
from typing import Any

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.offboard_client import Pilot, paused_in_the_air, pilot, truth
from tests.support.offboard_flights import GAP_S, RETURNS, fly_offboard, in_mode, paused
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet

STAYS = "RTL_LAND_DELAY=-1"
"""A return ends in the air: on a busy machine it might else be on the ground, and in Hold, before it is looked at."""


def is_north_of(now: dict[str, Any], before: dict[str, Any]) -> bool:
    """By three metres."""
    return bool(now["latitude_deg"] > before["latitude_deg"] + 3.0 / 111_195.0)


async def test_a_pilot_comes_and_goes_and_the_run_goes_on(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    with (
        SimulatedFleet("quad", speed=4.0, params=RETURNS) as simulated,
        ForkedService(tmp_path, simulated.connections, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        run_id = await paused_in_the_air(dispatcher)

        async def flies_north_and_goes_away(ann: Pilot) -> None:
            began = await truth(simulated)
            await until(lambda: truth(simulated), lambda v: is_north_of(v, began), "it must fly north", 20)
            assert (await dispatcher.get(f"/runs/{run_id}"))["reason"]["code"] == "run.offboard"
            await ann.leave()
            await in_mode(simulated, "LOITER", "a pilot who goes away is Hold, not the vehicle's failsafe")

        async def is_overruled_at_the_sticks(ben: Pilot) -> None:
            simulated.control("mode", "POSCTL", system_id=1)
            assert await ben.until_closed() == 4410
            assert ben.offboard["reason"]["params"].get("mode") == "position"
            assert (await truth(simulated))["mode"] == "POSCTL", "the pilot at the sticks is not fought"

        async def falls_silent(ann: Pilot) -> None:
            ann.fall_silent()
            await in_mode(simulated, "LOITER", "a silent pilot is Hold")
            assert await ann.until_closed() == 4410

        async def gives_back(ann: Pilot) -> None:
            assert (await ann.do("leave", to="mission"))["type"] == "done"

        for fly in (flies_north_and_goes_away, is_overruled_at_the_sticks, falls_silent, gives_back):
            await fly_offboard(http, service, run_id, fly)
        run = await dispatcher.until_run(run_id, lambda run: run["state"] == "flying", "the mission must go on", 20)
        assert run["item_id"] is not None


async def moves_nothing_after_it_woke(simulated: SimulatedFleet, service: ServiceProcess, ann: Pilot) -> None:
    """SIGSTOP, the vehicle's own failsafe, SIGCONT."""
    os.kill(service.pid, signal.SIGSTOP)
    stopped_s = time.monotonic()
    try:
        await in_mode(simulated, "RTL", "the vehicle's own failsafe must act while Waydrop hangs")
        await asyncio.sleep(max(0.0, GAP_S + 0.5 - (time.monotonic() - stopped_s)))
    finally:
        os.kill(service.pid, signal.SIGCONT)
    assert await ann.until_closed() == 4410, "the lease and the buffered frames are dropped"


async def test_a_hung_and_a_killed_waydrop_leave_the_vehicle_to_its_own_failsafe(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    """A service that hangs for long would end itself: here it is to wake again, however late the failsafe is seen."""
    settings = {"WAYDROP_OFFBOARD_GAP_S": str(GAP_S), "WAYDROP_HANG_EXIT_S": "0"}
    with (
        SimulatedFleet("quad", speed=4.0, params=f"{RETURNS},{STAYS}") as simulated,
        ForkedService(tmp_path, simulated.connections, **settings) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        run_id = await paused_in_the_air(dispatcher)
        await fly_offboard(http, service, run_id, lambda ann: moves_nothing_after_it_woke(simulated, service, ann))
        offboard = (await dispatcher.get("/vehicles/v1/offboard"))["offboard"]
        assert (offboard["state"], offboard["lease"]) == ("idle", None)
        promise = "what the vehicle did meanwhile has that as its cause"
        assert offboard["reason"]["code"] == "offboard.stood_still", promise
        assert (await truth(simulated))["mode"] == "RTL", "nothing pulls it back, and nothing commands another mode"
        await paused(dispatcher, run_id)
        async with pilot(http, service.url) as ben:
            await ben.enter()
            service.kill()
            await in_mode(simulated, "RTL", "the vehicle's own failsafe must act when Waydrop is killed")
