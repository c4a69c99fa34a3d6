"""VehicleLink.send_setpoint: each form arrives as meant, decoded by another MAVLink; and a vehicle follows it."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest

from app.domain.autopilot.capability import FirmwareProfile, FlightKind
from app.domain.errors import SetpointRefusedError, VehicleRefusedError
from app.domain.mission import NAN, MavCmd
from app.domain.offboard.control_method import capabilities
from app.domain.offboard.encode import encode
from app.domain.offboard.messages import AttitudeTarget, LocalTarget, SetpointMessage
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.state import FlightMode
from app.vehicles.command_sender import command
from app.vehicles.encoders import SetpointOut
from tests.contract.vehicles.listening_vehicle import ListeningVehicle, listening_vehicle
from tests.support.driving import armed, opened_link, streamed_enough, until
from tests.support.setpoint_examples import example, follower
from tests.support.simulated import SimulatedFleet

PROFILES = (FirmwareProfile.FLOWN, FirmwareProfile.DOCUMENTED)
RATE_S = 0.05
SENDS, AGAIN_S = 5, 2.0
"""What waits for a busy machine is dropped on its way, and never comes late: it is sent again."""


async def test_every_form_that_is_taken_arrives_with_its_frame_and_mask_and_every_other_is_never_sent() -> None:
    """One link for all of them: to find a vehicle takes longer than to send it everything."""
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:
        for kind in FlightKind:
            for profile in PROFILES:
                for known in capabilities(kind, profile):
                    if not known.support.is_accepted:
                        with pytest.raises(SetpointRefusedError):
                            link.send_setpoint(encode(example(known.form), follower(kind, profile)))
                        continue
                    vehicle.received.clear()
                    sent = encode(example(known.form), follower(kind, profile))
                    sends = await sent_until_it_arrives(vehicle, link, sent, known.wire.message)
                    setpoints = [m for m in vehicle.received if m.get_type().startswith("SET_")]
                    assert len(setpoints) <= sends, known.form
                    for message in setpoints:
                        assert_same(message, sent)


async def test_what_was_not_given_arrives_as_no_number_and_a_given_zero_as_zero() -> None:
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:
        still = encode(example("velocity_ned", north_m_s=0.0, east_m_s=0.0, down_m_s=0.0), follower())
        await sent_until_it_arrives(vehicle, link, still, "SET_POSITION_TARGET_LOCAL_NED")
        message = vehicle.of("SET_POSITION_TARGET_LOCAL_NED")[0]
        assert (message.vx, message.vy, message.vz) == (0.0, 0.0, 0.0)
        assert all(math.isnan(value) for value in (message.x, message.y, message.z, message.yaw, message.yaw_rate))


async def sent_until_it_arrives(vehicle: ListeningVehicle, link: VehicleLink, sent: SetpointMessage, name: str) -> int:
    """How often it was sent until a message of this name came."""
    for sends in range(1, SENDS + 1):
        link.send_setpoint(sent)
        with suppress(AssertionError):
            await until(lambda: bool(vehicle.of(name)), f"{name} must arrive", AGAIN_S)
            return sends
    raise AssertionError(f"{name} must arrive; it was sent {SENDS} times")


def assert_same(message: Any, sent: SetpointMessage) -> None:
    """Every field as it was meant; targets too."""
    assert (message.target_system, message.target_component, message.type_mask) == (1, 1, sent.type_mask)
    if isinstance(sent, AttitudeTarget):
        assert list(message.q) == pytest.approx(list(sent.q), abs=1e-6)
        rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
        assert rates == pytest.approx(sent.rates_rad_s, abs=1e-6)
        assert message.thrust == pytest.approx(sent.thrust)
        return
    assert message.coordinate_frame == sent.frame
    pairs = [((message.vx, message.vy, message.vz), sent.velocity)]
    if isinstance(sent, LocalTarget):
        pairs += [((message.x, message.y, message.z), sent.position)]
        pairs += [((message.afx, message.afy, message.afz), sent.acceleration)]
    else:
        assert (message.lat_int, message.lon_int) == (round(sent.latitude_deg * 1e7), round(sent.longitude_deg * 1e7))
        pairs += [((message.alt, 0.0, 0.0), (sent.altitude_m, 0.0, 0.0))]
    pairs += [((message.yaw, message.yaw_rate, 0.0), (sent.yaw_rad, sent.yaw_rate_rad_s, 0.0))]
    for arrived, meant in pairs:
        assert arrived == pytest.approx(meant, rel=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    "message",
    [
        replace(encode(example("velocity_ned"), follower()), velocity=(math.inf, 0.0, 0.0)),  # type: ignore[arg-type]
        replace(encode(example("velocity_ned"), follower()), velocity=(1e39, 0.0, 0.0)),  # type: ignore[arg-type]
        replace(encode(example("velocity_ned"), follower()), type_mask=70_000),
        replace(encode(example("attitude"), follower()), type_mask=256),
        replace(encode(example("position_global"), follower()), latitude_deg=91.0),  # type: ignore[arg-type]
    ],
)
def test_what_mavlink_cannot_carry_is_an_error_and_not_another_number(message: SetpointMessage) -> None:
    with pytest.raises(ValueError, match="is no"):
        SetpointOut(message).fields_json(1, 1)


LOSS_S = 5.0
"""By the wall: the simulated vehicle has it four times as long on its own clock."""


@pytest.fixture(scope="module")
def hovering() -> Iterator[SimulatedFleet]:
    """Offboard control is flown at no more than four times real time. The stream may pause on a busy machine."""
    with SimulatedFleet("quad", speed=4.0, params=f"COM_OBL_RC_ACT=5,COM_OF_LOSS_T={LOSS_S}") as fleet:
        yield fleet


async def streamed(link: VehicleLink, message: SetpointMessage) -> None:
    while True:
        link.send_setpoint(message)
        await asyncio.sleep(RATE_S)


async def test_a_vehicle_enters_follows_and_holds_by_itself_when_the_stream_stops(hovering: SimulatedFleet) -> None:
    async with opened_link(hovering.connections) as link:
        await armed(link)
        async for ack in link.command(command(MavCmd.NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, NAN)):
            assert ack.word == "ACCEPTED"
        await until(lambda: (link.state().relative_altitude_m or 0.0) > 2.0, "it must climb", 30.0)
        await link.hold()
        with pytest.raises(VehicleRefusedError) as refused:
            await link.enter_offboard()
        assert refused.value.extra["texts"], "without a stream the vehicle says why"
        north = encode(example("velocity_ned", north_m_s=3.0, east_m_s=0.0, down_m_s=0.0), follower())
        stream = asyncio.create_task(streamed(link, north))
        await streamed_enough(link)
        await link.enter_offboard()
        await until(lambda: (link.state().velocity_north_m_s or 0.0) > 1.0, "it must fly north", 20.0)
        stream.cancel()
        await until(lambda: link.state().mode is FlightMode.HOLD, "its own failsafe must act", 20.0)
        assert link.state().home_ned_m is not None
        await link.land()


async def test_parameters_are_read_anew_and_those_that_do_not_exist_are_left_out(hovering: SimulatedFleet) -> None:
    async with opened_link(hovering.connections) as link:
        found = await link.read_parameters(("COM_OBL_RC_ACT", "COM_OF_LOSS_T", "NO_SUCH_PARAM"))
        assert found == {"COM_OBL_RC_ACT": 5, "COM_OF_LOSS_T": pytest.approx(4.0 * LOSS_S)}


async def test_while_python_hangs_nothing_is_sent_but_mavsdks_own_heartbeat() -> None:
    """So a hung process keeps the link alive, and NAV_DLL_ACT never acts: services/hang_watch.py ends it."""
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:
        stream = asyncio.create_task(streamed(link, encode(example("velocity_ned"), follower())))
        await vehicle.first("SET_POSITION_TARGET_LOCAL_NED")
        vehicle.received.clear()
        time.sleep(2.5)  # noqa: ASYNC251 - the loop hangs; what arrived meanwhile waits in the kernel
        stream.cancel()
        await until(lambda: len(vehicle.of("HEARTBEAT")) >= 2, "mavsdk's thread must have gone on", 10.0)
        assert len(vehicle.of("SET_POSITION_TARGET_LOCAL_NED")) <= 1, "no setpoint comes of a loop that hangs"
