"""A plane on firmware that follows no path point, with tasks in its queue, and what it was ordered."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

from app.domain.vehicle.commands import CommandRequest
from app.domain.vehicle.state import FirmwareVersion, FlightMode, VehicleType
from tests.support.controlled_vehicle import ControlledVehicle, controlled_vehicle
from tests.support.queued_tasks import put_at, queue

OLD = FirmwareVersion(1, 14, 3)
FAR: dict[str, Any] = {"point": {"east_m": 0.0, "north_m": 400.0}}
CIRCLE: dict[str, Any] = {"radius_m": -60.0}


@contextlib.asynccontextmanager
async def plane(vehicle_type: VehicleType = VehicleType.FIXED_WING, **more: Any) -> AsyncIterator[ControlledVehicle]:
    """In the air, flying north, in a mode that Hold ends: in Hold an entry tells it to circle first."""
    async with controlled_vehicle(vehicle_type, **more) as found:
        found.vehicle.identity = replace(found.vehicle.identity, firmware=OLD)
        found.vehicle.parameters = {"COM_OBL_RC_ACT": 0, "NAV_LOITER_RAD": 80.0}
        put_at(found, 0.0, 0.0, velocity_north_m_s=15.0, mode=FlightMode.POSITION)
        found.take()
        yield found


async def flying(plane: ControlledVehicle, kind: str, **changed: Any) -> str:
    """Queue, enter, and see the first order accepted."""
    made = queue(plane, kind, **changed)
    await plane.enter()
    await ordered(plane, 1)
    return made


async def ordered(plane: ControlledVehicle, count: int) -> CommandRequest:
    """So many orders were sent; the last of them, answered."""

    def answered() -> bool:
        plane.clock.time_s += 0.01
        order = plane.control.view().command
        return len(plane.vehicle.orders) >= count and (order is None or order.result != "sent")

    await plane.until(answered, f"{count} orders must be sent, not {len(plane.vehicle.orders)}")
    return plane.vehicle.orders[-1]


async def client_sends(plane: ControlledVehicle, form: str) -> None:
    """As a client does, again and again."""
    while True:
        plane.put(form)
        await asyncio.sleep(0.01)


async def gone_on(plane: ControlledVehicle, seconds: float) -> None:
    """Time passes, and the client renews nothing; ticks come."""
    for _ in range(round(seconds / 0.3)):
        plane.clock.time_s += 0.3
        looks = plane.vehicle.looks
        await plane.until(
            lambda looks=looks: plane.vehicle.looks > looks + 2 or plane.control.lease is None,  # type: ignore[misc]
            "ticks come",
        )
