"""`waydrop hold`: the vehicle holds, whoever flies it."""

from __future__ import annotations

from pathlib import Path

import pytest
from aiohttp import web

from app.cli.service_client import service_client
from app.cli.terminal import ServerRefusedError
from app.cli.vehicles import hold_vehicle
from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.scripted_service import answering
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


async def test_a_vehicle_that_is_being_started_is_held_as_soon_as_it_flies() -> None:
    starting, asked = {"status": 409, "code": "run.wrong_state", "state": "starting", "detail": "starting"}, 0

    async def answer(request: web.Request) -> web.Response:
        nonlocal asked
        if request.method == "GET":
            return web.json_response({"id": "v1", "run_id": "r1"})
        asked += 1
        return web.json_response(starting if asked < 3 else {}, status=409 if asked < 3 else 202)

    async with answering(answer) as url, service_client(url, None) as client:
        assert (await hold_vehicle(client, "v1"))["id"] == "v1"
    assert asked == 3


async def test_an_unknown_vehicle_is_refused(tmp_path: Path) -> None:
    async with run_service(tmp_path) as service, service_client(service.url, None) as client:
        with pytest.raises(ServerRefusedError, match="v9"):
            await hold_vehicle(client, "v9")
