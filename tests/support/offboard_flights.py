"""A person takes a vehicle out of its run and flies it; whatever dies, nothing of ours moves the vehicle."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import aiohttp

from tests.support.offboard_client import Pilot, pilot, truth
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet

GAP_S = 2.5
"""More than the default: on a busy machine a healthy process may stand still for longer than that."""
LATE_FAILSAFE = "COM_OF_LOSS_T=4"
"""Later than GAP_S, as that setting asks for: the vehicle stays with a service that goes on after a shorter gap."""
RETURNS = f"COM_OBL_RC_ACT=3,{LATE_FAILSAFE}"
"""The vehicle's own answer to a lost stream is another mode than the Hold that Waydrop commands."""

TRIES = 3
STANDSTILLS = ("offboard.client_silent", "offboard.stood_still")
"""Why a lease ends when a test, or the service, stands still: as it should, but it is not what the test is about."""


async def in_mode(fleet: SimulatedFleet, mode: str, promise: str) -> dict[str, Any]:
    found: dict[str, Any] = await until(lambda: truth(fleet), lambda v: v["mode"] == mode, promise, 30)
    return found


async def fly_offboard(
    http: aiohttp.ClientSession, service: ServiceProcess, run_id: str, fly: Callable[[Pilot], Awaitable[None]]
) -> None:
    """A pilot enters and flies the vehicle of a paused run; once more if a busy machine stood still meanwhile."""
    dispatcher = Dispatcher(http, service.url)
    for tries_left in reversed(range(TRIES)):
        try:
            async with pilot(http, service.url) as someone:
                await someone.enter()
                await fly(someone)
            return
        except (AssertionError, ConnectionError):
            offboard = (await dispatcher.get("/vehicles/v1/offboard"))["offboard"]
            if not tries_left or (offboard["reason"] or {}).get("code") not in STANDSTILLS:
                raise
        await paused(dispatcher, run_id)


async def paused(dispatcher: Dispatcher, run_id: str) -> None:
    """Whatever the vehicle did."""
    await dispatcher.post(f"/runs/{run_id}/pause")
    await dispatcher.until_run(run_id, lambda run: run["state"] == "paused", "it must pause", 20)
