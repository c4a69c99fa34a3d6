"""Commands outside a run: a rover stops before it is landed, because in Land mode it drives on and is switched off."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from app.domain.errors import ConflictError, VehicleTakenError
from app.domain.vehicle.state import FlightMode, LandedState, VehicleType
from app.services.vehicle_commands import land_here
from tests.support.scripted_link import ScriptedVehicle


def driving(speed_m_s: float = 2.9, vehicle_type: VehicleType = VehicleType.ROVER) -> ScriptedVehicle:
    vehicle = ScriptedVehicle(vehicle_type)
    vehicle.put(armed=True, mode=FlightMode.MISSION, landed=LandedState.IN_AIR, velocity_north_m_s=speed_m_s)
    return vehicle


async def until(what: Callable[[], bool]) -> None:
    async with asyncio.timeout(10.0):
        while not what():
            await asyncio.sleep(0.005)


async def test_a_rover_that_drives_is_landed_once_it_stands_in_hold() -> None:
    rover = driving()
    landing = asyncio.create_task(land_here(rover))
    await until(lambda: rover.sent == ["hold"])
    rover.put(velocity_north_m_s=0.4)
    looks = rover.looks
    await until(lambda: rover.looks > looks + 5)
    assert rover.sent == ["hold"]
    rover.put(velocity_north_m_s=0.1)
    await landing
    assert rover.sent == ["hold", "land"]


@pytest.mark.parametrize("vehicle", [driving(0.0), driving(5.0, VehicleType.MULTICOPTER)], ids=["stands", "flies"])
async def test_what_stands_or_flies_is_landed_at_once(vehicle: ScriptedVehicle) -> None:
    await land_here(vehicle)
    assert vehicle.sent == ["land"]


@pytest.mark.parametrize(
    "seen", [{"velocity_north_m_s": 2.0}, {"velocity_north_m_s": None}, {"connected": False, "velocity_north_m_s": 0.0}]
)
async def test_a_rover_that_is_not_seen_to_stop_holds_and_is_not_landed(
    monkeypatch: pytest.MonkeyPatch, seen: dict[str, Any]
) -> None:
    monkeypatch.setattr("app.services.vehicle_commands.STOPS_WITHIN_S", 0.1)
    rover = driving()
    rover.put(**seen)
    with pytest.raises(ConflictError, match="not landed: the rover was not seen to stop"):
        await land_here(rover)
    assert rover.sent == ["hold"]


async def test_a_rover_that_somebody_takes_as_it_stops_is_theirs() -> None:
    rover = driving()
    landing = asyncio.create_task(land_here(rover))
    await until(lambda: rover.sent == ["hold"])
    rover.put(mode=FlightMode.MANUAL)
    with pytest.raises(VehicleTakenError, match="MANUAL"):
        await landing
    assert rover.sent == ["hold"]
