"""The offboard websocket: frames and their answers, and that its end is the end of the lease."""

from __future__ import annotations

import asyncio

import aiohttp
import pytest

from app.api.websockets import CloseCode
from app.domain.offboard.setpoints import VelocityNed
from app.domain.vehicle.state import FlightMode
from app.services.access import Role
from app.services.background import background
from tests.support.fake_links import FakeLink
from tests.support.offboard_api import NORTH, PATH, link
from tests.support.offboard_socket import pilot
from tests.support.reasons import words
from tests.support.service_in_process import Service, until

__all__ = ["link"]


async def test_offboard_control_over_one_socket(service: Service, link: FakeLink) -> None:
    async with pilot(service) as ann:
        granted = await ann.send("acquire_lease", rate_hz=50)
        assert (granted["type"], granted["id"], granted["holder"]) == ("lease_granted", 7, "local")
        assert (await ann.send("setpoint", setpoint=NORTH))["type"] == "setpoint_ack"
        done = await ann.send("enter")
        assert (done["type"], done["command"], done["audit"][0]["parameter"]) == ("done", "enter", "COM_OBL_RC_ACT")
        clamped = await ann.send("setpoint", setpoint={**NORTH, "north_m_s": 80.0})
        assert [clamp["code"] for clamp in clamped["clamped"]] == ["limit.speed"]
        refused = await ann.send("setpoint", setpoint={"type": "position_body", "forward_m": 1.0})
        assert (refused["type"], refused["code"]) == ("error", "setpoint.frame_unsupported")
        active = await ann.state("active")
        assert active["sent"]["message"] == "SET_POSITION_TARGET_LOCAL_NED"
        assert active["rate"]["target_hz"] == 50.0
        assert (await ann.send("leave", to="hold"))["type"] == "done"
        assert link.state().mode is FlightMode.HOLD
        assert (await ann.send("acquire_lease"))["type"] == "lease_granted", "the same socket may take it again"


async def test_the_end_of_the_socket_is_hold_at_once(service: Service, link: FakeLink) -> None:
    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        await ann.send("enter")
        assert link.state().mode is FlightMode.OFFBOARD
    await until(lambda: link.state().mode is FlightMode.HOLD, timeout_s=10)
    sent = len(link.setpoints)
    async with pilot(service) as ben:
        assert (await ben.send("acquire_lease"))["type"] == "lease_granted"
        assert len(link.setpoints) == sent


async def test_a_socket_that_closes_while_leaving_is_hold_too(service: Service, link: FakeLink) -> None:
    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        await ann.send("enter")
        waits, original = asyncio.Event(), link.return_to_launch

        async def slow() -> None:
            waits.set()
            await asyncio.Event().wait()

        link.return_to_launch = slow  # type: ignore[method-assign]
        await ann.socket.send_json({"type": "leave", "to": "return"})
        await asyncio.wait_for(waits.wait(), 60)
        link.return_to_launch = original  # type: ignore[method-assign]
    await until(lambda: link.state().mode is FlightMode.HOLD, timeout_s=10)
    assert service.services.offboard.vehicle("v1").lease is None


async def test_a_second_socket_is_told_who_flies(service: Service, link: FakeLink) -> None:
    async with pilot(service) as ann, pilot(service) as ben:
        await ann.send("acquire_lease")
        refused = await ben.send("acquire_lease")
        assert (refused["code"], refused["extra"]["holder"]) == ("offboard.lease_held", "local")
        assert (await ann.send("hand_over_lease", to="local"))["type"] == "done"
        assert (await ben.send("acquire_lease"))["type"] == "lease_granted"
        assert await ann.close_code() == CloseCode.LEASE_ENDED


async def test_a_lost_lease_closes_the_socket_and_what_was_still_to_be_read_is_dropped(
    service: Service, link: FakeLink
) -> None:
    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        await ann.send("enter")
        link.change(mode=FlightMode.POSITION)  # an RC pilot
        sent = len(link.setpoints)
        for _ in range(5):
            await ann.socket.send_json({"type": "setpoint", "setpoint": NORTH})
        assert "position mode" in words((await ann.state("idle"))["reason"])
        assert await ann.close_code() == CloseCode.LEASE_ENDED
        assert len(link.setpoints) == sent
        assert link.state().mode is FlightMode.POSITION


async def test_without_a_lease_nothing_is_taken(service: Service, link: FakeLink) -> None:
    async with pilot(service) as ann:
        for kind, fields in (("setpoint", {"setpoint": NORTH}), ("enter", {}), ("leave", {}), ("release_lease", {})):
            refused = await ann.send(kind, **fields)
            assert (refused["type"], refused["code"]) == ("error", "offboard.lease_lost"), kind
        await ann.send("acquire_lease")
        assert (await ann.send("renew_lease"))["command"] == "renew_lease"
        assert (await ann.send("release_lease"))["command"] == "release_lease"
        assert link.setpoints == []


@pytest.mark.parametrize(
    "text",
    ["", "no json", "[]", '{"type": "acquire_lease", "x": 1}', '{"type": "fly"}', '{"type": "setpoint"}', '"\\ud83d"'],
)
async def test_what_is_no_frame_is_refused_and_the_socket_stays(service: Service, text: str) -> None:
    async with pilot(service) as ann:
        await ann.socket.send_str(text)
        refused = await ann.answer()
        assert (refused["type"], refused["code"]) == ("error", "request.invalid")
        assert (await ann.send("acquire_lease"))["type"] == "lease_granted"


async def test_a_binary_frame_ends_the_socket_as_such_and_the_vehicle_holds(service: Service, link: FakeLink) -> None:
    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        await ann.send("enter")
        await ann.socket.send_bytes(b"\x00")
        assert await ann.close_code() == CloseCode.UNSUPPORTED
    await until(lambda: link.state().mode is FlightMode.HOLD, timeout_s=10)


async def test_frames_that_wait_do_not_keep_the_event_loop(service: Service) -> None:
    """All other vehicles' setpoints are sent on it."""
    frames, turns = 500, 0

    async def turn() -> None:
        nonlocal turns
        while True:
            await asyncio.sleep(0)
            turns += 1

    async with pilot(service) as ann, background(turn(), "turns of the loop"):
        for _ in range(frames):
            await ann.socket.send_str("x")
        before = turns
        for _ in range(frames):
            assert (await ann.answer())["code"] == "request.invalid"
        assert turns - before >= frames, "a turn for the others between two frames"


async def test_what_cannot_be_flown_is_told_by_the_close_code_and_an_override_needs_an_admin(service: Service) -> None:
    token = await service.token(Role.PILOT)
    async with pilot(service, "/api/v1/vehicles/v99/offboard", headers=token) as ann:
        assert await ann.close_code() == CloseCode.NO_VEHICLE
    async with pilot(service, headers=token) as ann:
        refused = await ann.send("acquire_lease", override=True)
        assert refused["code"] == "role.insufficient"


async def test_a_foreign_page_flies_nothing(service: Service) -> None:
    with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
        await service.http.ws_connect(service.url + PATH, headers={"Origin": "https://evil.example"})
    assert refused.value.status == 403


async def test_when_the_service_stops_the_sockets_are_closed_and_the_vehicle_holds(
    service: Service, link: FakeLink
) -> None:
    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        await ann.send("enter")
        await service.app.shutdown()
        assert await ann.close_code() == CloseCode.GOING_AWAY
    await until(lambda: link.state().mode is FlightMode.HOLD, timeout_s=10)


async def test_what_no_message_can_say_is_refused_and_the_socket_stays(
    service: Service, link: FakeLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    def beyond(_: str, setpoint: VelocityNed) -> None:
        VelocityNed(type="velocity_ned", north_m_s=setpoint.north_m_s * 1e9, east_m_s=0.0)

    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        with monkeypatch.context() as patch:
            patch.setattr(service.services.offboard.vehicle("v1"), "put", beyond)
            refused = await ann.send("setpoint", setpoint=NORTH)
        assert (refused["type"], refused["code"], refused["hint"]) == ("error", "request.invalid", "use smaller values")
        assert (await ann.send("setpoint", setpoint=NORTH))["type"] == "setpoint_ack"
