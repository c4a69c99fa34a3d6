"""A run sends what flies its mission only while this gateway may command the vehicle."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable
from dataclasses import replace
from typing import Any

import pytest

from app.domain.errors import VehicleTakenError
from app.domain.mission import MavCmd, Mission
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.vehicle.commands import CommandRequest
from app.services.runs.gated_link import GatedLink
from tests.support.flown_flights import MISSION
from tests.support.scripted_link import ScriptedVehicle


class Gate:
    """Whether this gateway may command."""

    def __init__(self) -> None:
        self.is_open = True

    def __call__(self) -> bool:
        return self.is_open


@pytest.mark.parametrize(
    "call",
    [
        lambda link: link.arm(),
        lambda link: link.start_mission(),
        lambda link: link.set_current(1),
        lambda link: anext(link.upload(MISSION)),
        lambda link: anext(link.replace_mission(MISSION)),
        lambda link: anext(link.command(CommandRequest(MavCmd.DO_GRIPPER, (0.0,) * 7))),
        lambda link: anext(link.command(replace(CIRCLE_HERE, place=(474000000, 85000000)))),
    ],
    ids=["arm", "start_mission", "set_current", "upload", "replace_mission", "command", "reposition"],
)
async def test_what_flies_the_mission_is_not_sent_while_another_gateway_may_command(call: Callable[[Any], Any]) -> None:
    vehicle, gate = ScriptedVehicle(), Gate()
    link = GatedLink.of(vehicle, gate)
    gate.is_open = False
    with pytest.raises(VehicleTakenError):
        await call(link)
    assert (vehicle.sent, vehicle.orders, vehicle.releases) == ([], [], [])


async def test_hold_return_and_land_are_always_sent() -> None:
    vehicle = ScriptedVehicle()
    link = GatedLink.of(vehicle, lambda: False)
    await link.hold()
    await link.return_to_launch()
    await link.land()
    assert vehicle.sent == ["hold", "return", "land"]


async def test_a_transfer_ends_when_another_gateway_may_have_the_vehicle() -> None:
    ended: list[bool] = []

    class Slow(ScriptedVehicle):
        async def upload(self, mission: Mission) -> AsyncGenerator[Any, None]:
            try:
                for step in range(10):
                    yield step
            finally:
                ended.append(True)

    gate = Gate()
    steps = GatedLink.of(Slow(), gate).upload(MISSION)
    assert await anext(steps) == 0
    gate.is_open = False
    with pytest.raises(VehicleTakenError):
        await anext(steps)
    assert ended == [True], "the transfer is cancelled"
