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
from tests.support.offboard_flights import GAP_S, in_mode
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet

RETURN = "COM_OBL_RC_ACT=3"
"""The vehicle's own answer to a lost stream is another mode than the Hold that Waydrop commands."""


def is_north_of(now: dict[str, Any], before: dict[str, Any]) -> bool:
    """By three metres."""
    return bool(now["latitude_deg"] > before["latitude_deg"] + 3.0 / 111_195.0)


async def test_a_pilot_comes_and_goes_and_the_run_goes_on(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    with (
        SimulatedFleet("quad", speed=4.0, params=RETURN) as simulated,
        ForkedService(tmp_path, simulated.connections, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        run_id = await paused_in_the_air(dispatcher)
        async with pilot(http, service.url) as ann:
            await ann.enter()
            began = await truth(simulated)
            await until(lambda: truth(simulated), lambda v: is_north_of(v, began), "it must fly north", 20)
            assert (await dispatcher.get(f"/runs/{run_id}"))["reason"]["code"] == "run.offboard"
            await ann.leave()
        await in_mode(simulated, "LOITER", "a pilot who goes away is Hold, not the vehicle's failsafe")
        async with pilot(http, service.url) as ben:
            await ben.enter()
            simulated.control("mode", "POSCTL", system_id=1)
            assert await ben.until_closed() == 4410
            assert ben.offboard["reason"]["params"]["mode"] == "position"
            assert (await truth(simulated))["mode"] == "POSCTL", "the pilot at the sticks is not fought"
        async with pilot(http, service.url) as ann:
            await ann.enter()
            ann.fall_silent()
            await in_mode(simulated, "LOITER", "a silent pilot is Hold")
            assert await ann.until_closed() == 4410
        async with pilot(http, service.url) as ann:
            await ann.enter()
            assert (await ann.do("leave", to="mission"))["type"] == "done"
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
    promise = "what the vehicle did meanwhile has that as its cause"
    assert ann.offboard["reason"]["code"] == "offboard.stood_still", promise


async def test_a_hung_and_a_killed_waydrop_leave_the_vehicle_to_its_own_failsafe(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with (
        SimulatedFleet("quad", speed=4.0, params=RETURN) as simulated,
        ForkedService(tmp_path, simulated.connections, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        run_id = await paused_in_the_air(dispatcher)
        async with pilot(http, service.url) as ann:
            await ann.enter()
            await moves_nothing_after_it_woke(simulated, service, ann)
        view = await dispatcher.get("/vehicles/v1/offboard")
        assert (view["offboard"]["state"], view["offboard"]["lease"]) == ("idle", None)
        assert (await truth(simulated))["mode"] == "RTL", "nothing pulls it back, and nothing commands another mode"
        await dispatcher.post(f"/runs/{run_id}/pause")
        await dispatcher.until_run(run_id, lambda run: run["state"] == "paused", "it must pause", 20)
        async with pilot(http, service.url) as ben:
            await ben.enter()
            service.kill()
            await in_mode(simulated, "RTL", "the vehicle's own failsafe must act when Waydrop is killed")
