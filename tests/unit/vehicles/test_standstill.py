"""After the process stood still no command is repeated: another gateway may have the vehicle."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable

import pytest

from app.domain.errors import LinkTimeoutError
from app.domain.mission import MavCmd, MissionType
from app.vehicles.command_sender import CommandSender, CurrentItem, command
from app.vehicles.encoders import CommandLong, MissionClearAll, MissionSetCurrent, Outgoing
from app.vehicles.inbox import Inbox
from app.vehicles.list_transfer import ListTransfer
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

LATE_S = 0.4


class OldFirmware:
    """It does not know command 224, and answers no other. `on_sent` is told of each message."""

    def __init__(self) -> None:
        self.sent: list[Outgoing] = []
        self.on_sent: Callable[[Outgoing], None] = lambda message: None
        self.inbox = Inbox(asyncio.get_running_loop(), capacity=64)
        self.sender = CommandSender(self._take, self.inbox, StatusTexts(lambda text: None), 245)
        self.current = CurrentItem(self._take, self.sender, self.inbox, LinkSettings(command_timeout_s=0.1))
        self.lists = ListTransfer(None, self._take, self.inbox, LinkSettings())  # type: ignore[arg-type]

    def count(self, kind: type[Outgoing]) -> int:
        """How many of these it was sent."""
        return sum(isinstance(message, kind) for message in self.sent)

    def stand_still(self, after: type[Outgoing], seconds: float) -> None:
        """The whole process, as under SIGSTOP, right after it sent this."""
        self.on_sent = lambda message: time.sleep(seconds) if isinstance(message, after) else None

    def show(self, seq: int) -> None:
        """MISSION_CURRENT."""
        self.inbox.post("MISSION_CURRENT", json.dumps({"seq": seq, "total": 5, "mission_state": 3, "mission_mode": 1}))

    def _take(self, message: Outgoing) -> None:
        self.sent.append(message)
        if isinstance(message, CommandLong) and message.command == MavCmd.DO_SET_MISSION_CURRENT:
            ack = {"command": message.command, "result": 3, "progress": 0, "result_param2": 0}  # UNSUPPORTED
            self.inbox.post("COMMAND_ACK", json.dumps({**ack, "target_system": 245, "target_component": 190}))
        self.on_sent(message)


@pytest.fixture
async def vehicle(monkeypatch: pytest.MonkeyPatch) -> OldFirmware:
    monkeypatch.setattr("app.domain.vehicle.commands.LATE_S", LATE_S)
    return OldFirmware()


async def test_a_command_is_not_repeated(vehicle: OldFirmware) -> None:
    vehicle.stand_still(CommandLong, 2 * LATE_S)
    with pytest.raises(LinkTimeoutError):
        await vehicle.sender.result(command(MavCmd.COMPONENT_ARM_DISARM, 1.0, timeout_s=0.1))
    assert vehicle.count(CommandLong) == 1


async def test_without_a_standstill_an_item_is_made_current_by_a_message() -> None:
    vehicle = OldFirmware()
    vehicle.on_sent = lambda message: vehicle.show(2) if isinstance(message, MissionSetCurrent) else None
    await vehicle.current.set(2)
    assert vehicle.count(MissionSetCurrent) == 1


async def test_the_message_does_not_follow_the_command(vehicle: OldFirmware) -> None:
    vehicle.stand_still(CommandLong, 3 * LATE_S)
    with pytest.raises(LinkTimeoutError):
        await vehicle.current.set(2)
    assert vehicle.count(MissionSetCurrent) == 0


async def test_the_message_is_not_repeated(vehicle: OldFirmware) -> None:
    vehicle.stand_still(MissionSetCurrent, 2.5 + 2 * LATE_S)
    with pytest.raises(LinkTimeoutError):
        await vehicle.current.set(2)
    assert vehicle.count(MissionSetCurrent) == 1


async def test_a_list_is_not_cleared_again(vehicle: OldFirmware) -> None:
    vehicle.stand_still(MissionClearAll, 0.75 + 2 * LATE_S)
    with pytest.raises(LinkTimeoutError):
        await vehicle.lists.clear(MissionType.FENCE)
    assert vehicle.count(MissionClearAll) == 1
