"""What the capability table takes for wings and rovers is followed by them, and they stay in OFFBOARD with it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager

import pytest

from app.domain.autopilot.capability import FlightKind
from app.domain.mission import NAN, MavCmd
from app.domain.offboard.encode import encode
from app.domain.offboard.messages import SetpointMessage
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.state import FlightMode, GlobalPosition, LandedState
from app.vehicles.command_sender import command
from tests.support.driving import armed, opened, streamed_enough, until
from tests.support.setpoint_examples import example, follower
from tests.support.simulated import SimulatedFleet

RATE_S = 0.05


@pytest.fixture(scope="module")
def plane_and_rover() -> Iterator[SimulatedFleet]:
    """Offboard control is flown at no more than four times real time. The stream may pause on a busy machine."""
    with SimulatedFleet("plane,rover", speed=4.0, params="COM_OBL_RC_ACT=5,COM_OF_LOSS_T=10") as fleet:
        yield fleet


@asynccontextmanager
async def offboard(link: VehicleLink, message: SetpointMessage) -> AsyncIterator[None]:
    """In OFFBOARD with this setpoint; ended by Hold."""

    async def stream() -> None:
        while True:
            link.send_setpoint(message)
            await asyncio.sleep(RATE_S)

    task = asyncio.create_task(stream())
    try:
        await streamed_enough(link)
        await link.enter_offboard()
        yield
        assert link.state().mode is FlightMode.OFFBOARD
    finally:
        await link.hold()
        task.cancel()


async def test_a_rover_follows_a_velocity_and_a_wing_the_line_through_a_point(plane_and_rover: SimulatedFleet) -> None:
    async with opened(plane_and_rover.connections, vehicles=2) as source:
        links = {link.identity.system_id: link for link in source.links()}
        await asyncio.gather(rover_drives(links[2]), wing_follows(links[1]))


async def rover_drives(rover: VehicleLink) -> None:
    await armed(rover)
    north = encode(example("velocity_ned", north_m_s=1.5, east_m_s=0.0), follower(FlightKind.ROVER))
    async with offboard(rover, north):
        await until(lambda: (rover.state().velocity_north_m_s or 0.0) > 1.0, "the rover must drive north", 30.0)


async def wing_follows(plane: VehicleLink) -> None:
    """A line to the west, through a point north of home."""
    await armed(plane)
    origin = plane.state().home  # of the local frame; PX4 moves home to where it detects the take-off
    assert origin is not None
    async for ack in plane.command(command(MavCmd.NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, NAN)):
        assert ack.word == "ACCEPTED"
    await until(lambda: plane.state().landed is LandedState.IN_AIR, "the plane must fly", 60.0)
    path = {"north_m": 200.0, "east_m": 0.0, "down_m": -50.0, "north_m_s": 0.0, "east_m_s": -12.0, "down_m_s": 0.0}
    west = encode(example("position_velocity_ned", **path), follower(FlightKind.WING))
    async with offboard(plane, west):
        await until(
            lambda: (plane.state().velocity_east_m_s or 0.0) < -8.0 and abs(north_m(plane, origin) - 200.0) < 5.0,
            "the plane must join the line",
            60.0,
        )


def north_m(link: VehicleLink, origin: GlobalPosition) -> float:
    """From the origin of the local frame."""
    latitude_deg = link.state().latitude_deg
    return 0.0 if latitude_deg is None else (latitude_deg - origin.latitude_deg) * 111_195.0
