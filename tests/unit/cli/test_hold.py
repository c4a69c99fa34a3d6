"""`waydrop hold`: the vehicle holds, whoever flies it."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.cli.service_client import service_client
from app.cli.terminal import ServerRefusedError
from app.cli.vehicles import hold_vehicle
from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.service_in_process import run_service


async def test_a_vehicle_without_a_run_is_told_to_hold_and_offboard_control_ends(tmp_path: Path) -> None:
    async with run_service(tmp_path) as service, service_client(service.url, None) as client:
        link = service.links[0]
        link.change(armed=True, landed=LandedState.IN_AIR, mode=FlightMode.OFFBOARD)
        vehicle = await hold_vehicle(client, "v1")
        assert (vehicle["state"]["mode"], link.state().mode) == ("hold", FlightMode.HOLD)


async def test_a_vehicle_with_a_run_is_held_through_its_run(tmp_path: Path) -> None:
    async with run_service(tmp_path) as service, service_client(service.url, None) as client:
        service.services.fleet.vehicle("v1").own("run-9")
        with pytest.raises(ServerRefusedError, match="run-9"):
            await hold_vehicle(client, "v1")  # no such run is known, and the vehicle's own path is not tried


async def test_an_unknown_vehicle_is_refused(tmp_path: Path) -> None:
    async with run_service(tmp_path) as service, service_client(service.url, None) as client:
        with pytest.raises(ServerRefusedError, match="v9"):
            await hold_vehicle(client, "v9")
