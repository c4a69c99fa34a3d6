"""VehicleLink and the mode that a vehicle is left in: down out of OFFBOARD, and Hold for one that is disarmed."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress

import pytest

from app.domain.mission import NAN, MavCmd
from app.domain.offboard.encode import encode
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.state import FlightMode
from app.vehicles.command_sender import command
from tests.support.driving import armed, opened_link, until
from tests.support.setpoint_examples import example, follower
from tests.support.simulated import SimulatedFleet

STREAM_S = 0.05


@pytest.fixture(scope="module")
def quad() -> Iterator[SimulatedFleet]:
    """As fast as anybody may be flown in OFFBOARD. The stream may pause on a busy machine."""
    with SimulatedFleet("quad", speed=4.0, params="COM_OBL_RC_ACT=5,COM_OF_LOSS_T=5") as fleet:
        yield fleet


async def _stream(link: VehicleLink) -> None:
    while True:
        link.send_setpoint(encode(example("velocity_ned", north_m_s=1.0, east_m_s=0.0, down_m_s=0.0), follower()))
        await asyncio.sleep(STREAM_S)


@asynccontextmanager
async def _in_offboard(link: VehicleLink) -> AsyncIterator[asyncio.Task[None]]:
    """In the air, with the stream that keeps it there."""
    await link.hold_disarmed()
    await armed(link)
    async for ack in link.command(command(MavCmd.NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, NAN)):
        assert ack.word == "ACCEPTED"
    await until(lambda: (link.state().relative_altitude_m or 0.0) > 2.0, "it must climb", 30.0)
    stream = asyncio.create_task(_stream(link))
    try:
        await asyncio.sleep(STREAM_S)
        await link.enter_offboard()
        yield stream
    finally:
        stream.cancel()
        with suppress(asyncio.CancelledError):
            await stream


async def _down_in_hold(link: VehicleLink) -> None:
    await until(lambda: link.state().armed is False, "it must land and disarm", 60.0)
    assert link.state().mode is FlightMode.HOLD, "in OFFBOARD nobody can arm it"


@pytest.mark.parametrize("way_down", [FlightMode.RETURN, FlightMode.LAND])
async def test_out_of_offboard_it_comes_down_to_hold(quad: SimulatedFleet, way_down: FlightMode) -> None:
    async with opened_link(quad.connections) as link, _in_offboard(link):
        await (link.return_to_launch() if way_down is FlightMode.RETURN else link.land())
        assert link.state().mode is way_down
        await _down_in_hold(link)


async def test_so_it_does_when_a_pilot_has_sent_it_home_before(quad: SimulatedFleet) -> None:
    async with opened_link(quad.connections) as link, _in_offboard(link):
        quad.control("mode", "RTL")
        await until(lambda: link.state().mode is FlightMode.RETURN, "it must return", 20.0)
        await link.land()
        await _down_in_hold(link)


async def test_so_it_does_when_its_failsafe_flies_and_whoever_streamed_was_killed(quad: SimulatedFleet) -> None:
    async with opened_link(quad.connections) as before, _in_offboard(before) as stream:
        stream.cancel()
        await until(lambda: before.state().in_failsafe, "its own failsafe must act", 20.0)
    async with opened_link(quad.connections) as link:
        await until(lambda: link.state().mode is FlightMode.HOLD, "it must be seen in its failsafe's Hold", 20.0)
        assert link.state().in_failsafe
        await link.return_to_launch()
        await _down_in_hold(link)


@pytest.mark.parametrize("left", ["OFFBOARD", "POSCTL", "RTL", "TAKEOFF", "MISSION", "ACRO", "LOITER"])
async def test_a_disarmed_vehicle_holds_and_arms(quad: SimulatedFleet, left: str) -> None:
    async with opened_link(quad.connections) as link:
        quad.control("mode", left)
        await link.hold_disarmed()
        assert link.state().mode is FlightMode.HOLD
        await armed(link)
        await link.disarm()
