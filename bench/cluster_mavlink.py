"""Real gateways with simulated vehicles, over MAVLink: how old positions are at an API node."""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import AsyncExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import aiohttp

from bench.cluster_parts import Parts
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet

SITES: Final = ("north", "south")
EACH: Final = 15
FOUND_S: Final = 120.0


async def position_ages_s(parts: Parts, http: aiohttp.ClientSession, seconds: float) -> list[float]:
    """`position_age_s` of each vehicle in each telemetry frame of a client of the API node."""
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        for site in SITES:
            fleet = SimulatedFleet(",".join(["quad"] * EACH), shared_port=True)
            await asyncio.to_thread(stack.enter_context, fleet)
            gateway = ServiceProcess(folder / site, fleet.connections, part="gateway")
            gateway.set(WAYDROP_SITE=site, **parts.environment)
            await asyncio.to_thread(stack.enter_context, gateway)
        dispatcher = Dispatcher(http, parts.node.url)
        deadline_s = time.monotonic() + FOUND_S
        while await _with_position(dispatcher) < len(SITES) * EACH:
            if time.monotonic() > deadline_s:
                raise RuntimeError("not all simulated vehicles have reached the API node")
            await asyncio.sleep(0.5)
        return await _ages_s(http, f"{parts.node.url}/api/v1/stream", seconds)


async def _with_position(dispatcher: Dispatcher) -> int:
    vehicles = (await dispatcher.get("/vehicles"))["vehicles"]
    ours = [one for one in vehicles if one["id"].startswith(SITES)]
    return sum(one["state"]["position_age_s"] is not None for one in ours)


async def _ages_s(http: aiohttp.ClientSession, url: str, seconds: float) -> list[float]:
    found: list[float] = []
    until_s = time.monotonic() + seconds
    async with http.ws_connect(url, max_msg_size=0) as socket:
        async for message in socket:
            if time.monotonic() > until_s:
                break
            if message.data.startswith('{"type":"telemetry"'):
                states = json.loads(message.data)["vehicles"]
                found += [state["position_age_s"] for name, state in states.items() if name.startswith(SITES)]
    return found
