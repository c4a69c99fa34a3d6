"""A person takes a vehicle out of its run and flies it; whatever dies, nothing of ours moves the vehicle."""

from __future__ import annotations

from typing import Any

from tests.support.offboard_client import truth
from tests.support.service_process import until
from tests.support.simulated import SimulatedFleet

GAP_S = 2.5
"""More than the default: on a busy machine a healthy process may stand still for longer than that."""


async def in_mode(fleet: SimulatedFleet, mode: str, promise: str) -> dict[str, Any]:
    found: dict[str, Any] = await until(lambda: truth(fleet), lambda v: v["mode"] == mode, promise, 30)
    return found
