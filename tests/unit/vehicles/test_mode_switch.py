"""A mode is commanded until it is seen, and never against somebody else who chose another one meanwhile."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Coroutine

import pytest

from app.domain.errors import LinkTimeoutError, VehicleTakenError
from app.domain.vehicle.state import FlightMode
from app.vehicles.command_sender import CommandSender
from app.vehicles.decoders import StatusTextChunk
from app.vehicles.encoders import Outgoing
from app.vehicles.inbox import Inbox
from app.vehicles.modes import ModeSwitch
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

MODES = {FlightMode.HOLD: 3.0, FlightMode.MISSION: 4.0, FlightMode.RETURN: 5.0}
SETTINGS = LinkSettings(command_timeout_s=0.1, mode_seen_timeout_s=0.4, mode_again_s=0.2, command_attempts=3)


class Commanded:
    """A vehicle that takes modes, or not. `on_sent` is told of each mode that is commanded."""

    def __init__(self, mode: FlightMode = FlightMode.HOLD) -> None:
        self.mode: FlightMode | None = mode
        self.sent: list[FlightMode] = []
        self.on_sent: Callable[[FlightMode], None] = lambda mode: None
        self.inbox = Inbox(asyncio.get_running_loop(), capacity=64)
        self.texts = StatusTexts(lambda text: None)
        sender = CommandSender(self._take, self.inbox, self.texts, 245)
        self.switch = ModeSwitch(sender, self.inbox, SETTINGS, lambda: self.mode)

    def answer(self, result: int = 0) -> None:
        """COMMAND_ACK of DO_SET_MODE; 0 is ACCEPTED, 2 DENIED."""
        ack = {"command": 176, "result": result, "progress": 0, "result_param2": 0}
        self.inbox.post("COMMAND_ACK", json.dumps({**ack, "target_system": 245, "target_component": 190}))

    def show(self, mode: FlightMode) -> None:
        """CURRENT_MODE."""
        self.mode = mode
        custom_mode = 4 << 16 | int(MODES[mode]) << 24
        told = {"standard_mode": 0, "custom_mode": custom_mode, "intended_custom_mode": custom_mode}
        self.inbox.post("CURRENT_MODE", json.dumps(told))

    def beat(self, mode: FlightMode, *, armed: bool = False) -> None:
        """HEARTBEAT of a multicopter with PX4."""
        self.mode = mode
        base_mode = 129 if armed else 1
        told = {"type": 2, "autopilot": 12, "base_mode": base_mode, "system_status": 3, "mavlink_version": 3}
        self.inbox.post("HEARTBEAT", json.dumps({**told, "custom_mode": 4 << 16 | int(MODES[mode]) << 24}))

    def _take(self, message: Outgoing) -> None:
        sub_mode = getattr(message, "params")[2]  # noqa: B009 - of every command
        mode = next(mode for mode, number in MODES.items() if number == sub_mode)
        self.sent.append(mode)
        self.on_sent(mode)


async def test_a_late_answer_of_hold_on_the_way_is_not_taken_for_that_of_return() -> None:
    vehicle = Commanded(FlightMode.OFFBOARD)
    returns = 0

    def take(mode: FlightMode) -> None:
        nonlocal returns
        if mode is FlightMode.RETURN:
            returns += 1
            vehicle.answer()  # the first is Hold's, which is late; this Return is lost
            if returns == 2:
                vehicle.show(FlightMode.RETURN)

    vehicle.on_sent = take
    await vehicle.switch.through_hold_to(FlightMode.RETURN)
    assert vehicle.sent == [FlightMode.HOLD, FlightMode.RETURN, FlightMode.RETURN]


async def test_a_late_refusal_of_hold_on_the_way_is_not_taken_for_that_of_return() -> None:
    vehicle = Commanded(FlightMode.OFFBOARD)

    def take(mode: FlightMode) -> None:
        if mode is FlightMode.RETURN and vehicle.sent.count(mode) == 1:
            vehicle.answer(2)
        elif mode is FlightMode.RETURN:
            vehicle.show(FlightMode.RETURN)

    vehicle.on_sent = take
    await vehicle.switch.through_hold_to(FlightMode.RETURN)
    assert vehicle.sent == [FlightMode.HOLD, FlightMode.RETURN, FlightMode.RETURN]


async def test_a_mode_that_nobody_answers_is_commanded_as_often_as_any_command() -> None:
    vehicle = Commanded()
    with pytest.raises(LinkTimeoutError):
        await vehicle.switch.to(FlightMode.MISSION)
    assert vehicle.sent == [FlightMode.MISSION] * 3


@pytest.mark.parametrize("answered", [False, True])
async def test_a_process_that_stood_still_does_not_command_the_mode_again(
    monkeypatch: pytest.MonkeyPatch, answered: bool
) -> None:
    monkeypatch.setattr("app.domain.vehicle.commands.LATE_S", 0.5)
    vehicle = Commanded()

    def take(_mode: FlightMode) -> None:
        if answered:
            vehicle.answer()
        time.sleep(1.0)  # the whole process, as under SIGSTOP: another gateway has the vehicle meanwhile

    vehicle.on_sent = take
    with pytest.raises(LinkTimeoutError):
        await vehicle.switch.to(FlightMode.MISSION, until_seen=True)
    assert vehicle.sent == [FlightMode.MISSION]


async def test_a_mode_that_is_acknowledged_and_not_entered_is_explained_by_the_vehicles_texts() -> None:
    vehicle = Commanded()
    vehicle.texts.take(StatusTextChunk(2, "of before", 0, 0), time.monotonic() - 1.0)

    def take(_mode: FlightMode) -> None:
        vehicle.answer()
        text = StatusTextChunk(2, "No valid mission available, loitering", 0, 0)
        vehicle.texts.take(text, time.monotonic())

    vehicle.on_sent = take
    with pytest.raises(LinkTimeoutError, match=r"within 0\.4 s; No valid mission available, loitering$") as refused:
        await vehicle.switch.to(FlightMode.MISSION)
    assert refused.value.extra["texts"] == ("No valid mission available, loitering",)


@pytest.mark.parametrize("left_for", [FlightMode.HOLD, FlightMode.RETURN])
async def test_a_mode_that_showed_for_a_moment_is_explained_by_the_vehicles_texts(left_for: FlightMode) -> None:
    vehicle = Commanded()

    def take(_mode: FlightMode) -> None:
        vehicle.show(FlightMode.MISSION)  # its acknowledgement is lost
        vehicle.show(left_for)
        vehicle.texts.take(StatusTextChunk(2, "No valid mission available, loitering", 0, 0), time.monotonic())

    vehicle.on_sent = take
    with pytest.raises(VehicleTakenError, match=r"; No valid mission available, loitering$") as taken:
        await vehicle.switch.to(FlightMode.MISSION)
    assert taken.value.extra["texts"] == ("No valid mission available, loitering",)


@pytest.mark.parametrize("armed", [False, True])
async def test_a_mode_that_was_never_entered_is_explained_too_if_the_vehicle_was_taken(armed: bool) -> None:
    vehicle = Commanded()
    vehicle.beat(FlightMode.HOLD, armed=True)
    await asyncio.sleep(0)

    def take(_mode: FlightMode) -> None:
        vehicle.beat(FlightMode.RETURN if armed else FlightMode.HOLD, armed=armed)
        vehicle.texts.take(StatusTextChunk(2, "Low battery level", 0, 0), time.monotonic())

    vehicle.on_sent = take
    with pytest.raises(VehicleTakenError, match=r"; Low battery level$"):
        await vehicle.switch.to(FlightMode.MISSION)
    assert vehicle.sent == [FlightMode.MISSION]


async def test_a_mode_is_seen_without_an_answer() -> None:
    vehicle = Commanded()
    vehicle.on_sent = vehicle.show
    await vehicle.switch.to(FlightMode.MISSION)
    assert vehicle.sent == [FlightMode.MISSION]


@pytest.mark.parametrize("taken", [FlightMode.POSITION, FlightMode.RETURN, FlightMode.LAND])
async def test_whoever_chooses_another_mode_meanwhile_is_not_fought(taken: FlightMode) -> None:
    vehicle = Commanded()

    def take(_mode: FlightMode) -> None:
        vehicle.mode = taken

    vehicle.on_sent = take
    with pytest.raises(VehicleTakenError, match=f"now in {taken.value.upper()} mode"):
        await vehicle.switch.to(FlightMode.MISSION)
    assert vehicle.sent == [FlightMode.MISSION]


@pytest.mark.parametrize(
    "command", [ModeSwitch.to_hold_disarmed, lambda switch: switch.to(FlightMode.HOLD)], ids=["disarmed", "any"]
)
async def test_a_mode_that_was_seen_before_another_one_does_not_confirm_the_command(
    command: Callable[[ModeSwitch], Coroutine[None, None, None]],
) -> None:
    vehicle = Commanded()

    def take(_mode: FlightMode) -> None:
        vehicle.show(FlightMode.HOLD)  # sent before somebody left the vehicle in Return
        vehicle.beat(FlightMode.RETURN)
        vehicle.answer()
        asyncio.get_running_loop().call_later(0.1, vehicle.show, FlightMode.HOLD)

    vehicle.on_sent = take
    began = asyncio.create_task(command(vehicle.switch))
    await asyncio.sleep(0)
    vehicle.beat(FlightMode.RETURN)
    await began
    assert (vehicle.sent, vehicle.mode) == ([FlightMode.HOLD], FlightMode.HOLD)


async def test_a_mode_that_was_seen_before_another_one_is_no_answer() -> None:
    vehicle = Commanded(FlightMode.MISSION)

    def take(_mode: FlightMode) -> None:
        vehicle.show(FlightMode.HOLD)
        vehicle.show(FlightMode.MISSION)

    vehicle.on_sent = take
    with pytest.raises(LinkTimeoutError):
        await vehicle.switch.to(FlightMode.HOLD)
    assert vehicle.sent == [FlightMode.HOLD] * 3


@pytest.mark.parametrize("mode", [FlightMode.MISSION, FlightMode.RETURN])
async def test_whoever_takes_hold_after_the_mode_was_entered_is_not_fought(mode: FlightMode) -> None:
    vehicle = Commanded()

    def take(_mode: FlightMode) -> None:
        vehicle.show(mode)  # its acknowledgement is lost
        vehicle.show(FlightMode.HOLD)

    vehicle.on_sent = take
    with pytest.raises(VehicleTakenError, match="now in HOLD mode"):
        await vehicle.switch.to(mode)
    assert vehicle.sent == [mode]


async def test_a_mode_that_was_entered_and_left_after_its_acknowledgement_was_seen() -> None:
    vehicle = Commanded()

    def shown() -> None:
        vehicle.show(FlightMode.MISSION)
        vehicle.show(FlightMode.HOLD)  # the mission was over at once

    def take(_mode: FlightMode) -> None:
        vehicle.answer()
        asyncio.get_running_loop().call_later(0.1, shown)

    vehicle.on_sent = take
    await vehicle.switch.to(FlightMode.MISSION)
    assert vehicle.sent == [FlightMode.MISSION]


@pytest.mark.parametrize("disarmed", [False, True])
async def test_a_vehicle_that_was_disarmed_meanwhile_is_not_put_into_mission_mode_again(disarmed: bool) -> None:
    vehicle = Commanded()
    vehicle.beat(FlightMode.HOLD, armed=True)
    await asyncio.sleep(0)
    vehicle.on_sent = lambda _mode: vehicle.beat(FlightMode.HOLD, armed=not disarmed)
    with pytest.raises(VehicleTakenError if disarmed else LinkTimeoutError) as caught:
        await vehicle.switch.to(FlightMode.MISSION)
    assert len(vehicle.sent) == (1 if disarmed else 3)
    if not disarmed:
        assert "3 attempts without an answer" in caught.value.detail


@pytest.mark.parametrize("shown_at", [1, 3])
async def test_hold_that_a_standing_vehicle_reports_and_never_acknowledges_is_entered(shown_at: int) -> None:
    vehicle = Commanded(FlightMode.MISSION)
    switching = asyncio.create_task(vehicle.switch.to_hold_disarmed())
    while not switching.done():
        vehicle.beat(FlightMode.HOLD if len(vehicle.sent) >= shown_at else FlightMode.MISSION)
        await asyncio.sleep(0.02)
    await switching
    assert vehicle.sent == [FlightMode.HOLD] * shown_at


async def test_hold_that_a_standing_vehicle_neither_reports_nor_acknowledges_names_all_attempts() -> None:
    vehicle = Commanded(FlightMode.MISSION)
    switching = asyncio.create_task(vehicle.switch.to_hold_disarmed())
    while not switching.done():
        vehicle.beat(FlightMode.MISSION)
        await asyncio.sleep(0.02)
    with pytest.raises(LinkTimeoutError, match="3 attempts without an answer"):
        await switching
    assert vehicle.sent == [FlightMode.HOLD] * 3
