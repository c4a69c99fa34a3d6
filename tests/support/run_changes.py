"""Changes of runs in flight over REST."""

from __future__ import annotations

import asyncio
from typing import Any

from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.runs_api import create, reaches
from tests.support.service_in_process import LOOK_AGAIN_S, Service


async def flying(service: Service, plan: dict[str, Any], item_id: str = "corner") -> dict[str, Any]:
    """A run on its way to an item."""
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    run = await create(service, made["id"], start=True)
    await reaches(service, run["id"], "flying")
    seq = {"corner": 1, "clinic": 2}[item_id]
    service.links[0].change(mission_seq=seq, landed=LandedState.IN_AIR, mode=FlightMode.MISSION)
    async with asyncio.timeout(60):
        while run["item_id"] != item_id:
            await asyncio.sleep(LOOK_AGAIN_S)
            _, _, run = await service.call("GET", f"/api/v1/runs/{run['id']}")
    return run
