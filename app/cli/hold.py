"""`waydrop hold VEHICLE`: stop a vehicle where it is, whoever flies it."""

from __future__ import annotations

import asyncio
from typing import Annotated, Any

import typer

from app.cli.service_client import ServerOption, ServiceClient, TokenOption, service_client
from app.cli.terminal import out
from app.cli.vehicles import vehicles_table

VehicleArgument = Annotated[str, typer.Argument(metavar="VEHICLE", help="The vehicle's id, as `vehicles` shows it.")]


def hold(vehicle: VehicleArgument, server: ServerOption, token: TokenOption = None) -> None:
    """Hold where the vehicle is: pauses its run, ends offboard control of it."""
    out().print(vehicles_table([asyncio.run(_hold(server, token, vehicle))]))


async def _hold(server: str, token: str | None, vehicle_id: str) -> Any:
    async with service_client(server, token) as client:
        return await hold_vehicle(client, vehicle_id)


async def hold_vehicle(client: ServiceClient, vehicle_id: str) -> Any:
    """The vehicle, in Hold."""
    vehicle = await client.get(f"/vehicles/{vehicle_id}")
    run_id = vehicle.get("run_id")
    await client.post(f"/vehicles/{vehicle_id}/hold" if run_id is None else f"/runs/{run_id}/pause")
    return await client.get(f"/vehicles/{vehicle_id}")
