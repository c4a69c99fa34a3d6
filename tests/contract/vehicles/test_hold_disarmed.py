"""VehicleLink.hold_disarmed and arm, and a vehicle that somebody arms at the same moment: it is told neither.

And wait_armed, for the moment after.

On a busy machine an order may come too late to be sent at all, and a frame too late to pass the guard.
"""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.errors import CommandExpiredError, LinkTimeoutError, VehicleTakenError
from app.domain.mission import MavCmd
from app.domain.vehicle.link_security import RefusalKind
from app.vehicles import LinkSettings, MavsdkLinkSource
from tests.contract.vehicles.listening_vehicle import ListeningVehicle, listening_vehicle
from tests.support.driving import opened, opened_link, until

ARMED, DISARMED = 0x81, 0x01
POSITION, TAKEOFF, OFFBOARD, HOLD = 3 << 16, 4 << 16 | 2 << 24, 6 << 16, 4 << 16 | 3 << 24


def _modes(vehicle: ListeningVehicle) -> list[Any]:
    return _sent(vehicle, MavCmd.DO_SET_MODE)


def _sent(vehicle: ListeningVehicle, number: MavCmd) -> list[Any]:
    return [message for message in vehicle.of("COMMAND_LONG") if message.command == number]


def _late(source: MavsdkLinkSource) -> int:
    """How many frames the guard dropped as too late."""
    return sum(refused.count for refused in source.refused() if refused.kind is RefusalKind.LATE)


async def test_an_armed_vehicle_is_not_told_to_hold_as_one_that_stands() -> None:
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:
        vehicle.base_mode, vehicle.custom_mode = ARMED, POSITION
        with pytest.raises(VehicleTakenError, match="armed in POSITION mode") as caught:
            await link.hold_disarmed()
        assert (caught.value.extra["mode"], caught.value.extra["armed"]) == ("position", True)
        assert _modes(vehicle) == []


async def test_one_that_is_armed_after_the_first_try_is_not_told_again() -> None:
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:

        def arm(message: Any) -> None:
            if message.get_type() == "COMMAND_LONG" and message.command == MavCmd.DO_SET_MODE:
                vehicle.base_mode, vehicle.custom_mode = ARMED, POSITION

        vehicle.on_heard = arm
        with pytest.raises(VehicleTakenError):
            await link.hold_disarmed()
        assert len(_modes(vehicle)) == 1


async def test_one_that_obeys_and_whose_answers_are_all_lost_holds() -> None:
    settings = LinkSettings(command_timeout_s=0.5)
    async with listening_vehicle() as vehicle, opened([vehicle.url], vehicles=1, settings=settings) as source:
        vehicle.base_mode, vehicle.custom_mode = DISARMED, OFFBOARD

        def obey(message: Any) -> None:
            if message.get_type() == "COMMAND_LONG" and message.command == MavCmd.DO_SET_MODE:
                vehicle.custom_mode = HOLD

        vehicle.on_heard = obey
        await source.links()[0].hold_disarmed()
        assert vehicle.custom_mode == HOLD


async def test_without_an_answer_it_is_tried_as_often_as_any_command() -> None:
    settings = LinkSettings(command_timeout_s=0.3, command_attempts=2)
    async with listening_vehicle() as vehicle, opened([vehicle.url], vehicles=1, settings=settings) as source:
        with pytest.raises((LinkTimeoutError, CommandExpiredError)) as caught:
            await source.links()[0].hold_disarmed()
        assert len(_modes(vehicle)) <= 2
        assert len(_modes(vehicle)) + _late(source) >= 2 or caught.type is CommandExpiredError


@pytest.mark.parametrize("mode", [POSITION, TAKEOFF, OFFBOARD])
async def test_a_vehicle_is_not_armed_in_a_mode_that_somebody_else_commanded(mode: int) -> None:
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:
        vehicle.base_mode, vehicle.custom_mode = DISARMED, mode
        with pytest.raises(VehicleTakenError) as caught:
            await link.arm()
        assert caught.value.extra["armed"] is False
        assert _sent(vehicle, MavCmd.COMPONENT_ARM_DISARM) == []


async def test_an_armed_vehicle_is_not_armed_again_px4_would_accept_that() -> None:
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:
        vehicle.base_mode, vehicle.custom_mode = ARMED, POSITION
        with pytest.raises(VehicleTakenError, match="armed in POSITION mode"):
            await link.arm()
        assert _sent(vehicle, MavCmd.COMPONENT_ARM_DISARM) == []


async def test_a_vehicle_is_armed_once_a_heartbeat_from_now_on_says_so() -> None:
    async with listening_vehicle() as vehicle, opened_link([vehicle.url]) as link:
        vehicle.base_mode, vehicle.custom_mode = ARMED, HOLD
        await until(lambda: link.state().armed is True, "it must report armed", 15.0)
        await link.wait_armed()
        vehicle.base_mode = DISARMED  # a pilot
        await until(lambda: link.state().armed is False, "it must report disarmed", 15.0)
        with pytest.raises(VehicleTakenError, match="disarmed again") as caught:
            await link.wait_armed()
        assert (caught.value.extra["mode"], caught.value.extra["armed"]) == ("hold", False)
        assert _sent(vehicle, MavCmd.COMPONENT_ARM_DISARM) == []


async def test_an_arming_without_an_answer_is_not_sent_again_before_the_next_heartbeat_was_looked_at() -> None:
    async with listening_vehicle() as vehicle, opened([vehicle.url], vehicles=1) as source:
        vehicle.custom_mode = HOLD
        with pytest.raises((LinkTimeoutError, CommandExpiredError)) as caught:
            await source.links()[0].arm()
        armings = len(_sent(vehicle, MavCmd.COMPONENT_ARM_DISARM))
        assert armings <= 1
        assert armings + _late(source) >= 1 or caught.type is CommandExpiredError
