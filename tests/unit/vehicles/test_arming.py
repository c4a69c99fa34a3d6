"""Disarming is believed when a HEARTBEAT shows it: its acknowledgement cannot be told from that of an arming."""

from __future__ import annotations

import asyncio
import json
import time

import pytest

from app.domain.errors import LinkTimeoutError
from app.vehicles.command_sender import CommandSender
from app.vehicles.encoders import Outgoing
from app.vehicles.inbox import Inbox
from app.vehicles.modes import Arming
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

SETTINGS = LinkSettings(command_timeout_s=0.1, mode_seen_timeout_s=0.3, command_attempts=3)


class Armed:
    """An armed vehicle that answers each disarming, and obeys the one of this number."""

    def __init__(self, obeys: int) -> None:
        self.obeys = obeys
        self.sent = 0
        self.stands_still_s = 0.0
        self.inbox = Inbox(asyncio.get_running_loop(), capacity=64)
        sender = CommandSender(self._take, self.inbox, StatusTexts(lambda text: None), 245)
        self.arming = Arming(sender, self.inbox, SETTINGS)

    def _take(self, _message: Outgoing) -> None:
        self.sent += 1
        time.sleep(self.stands_still_s)  # the whole process, as under SIGSTOP
        ack = {"command": 400, "result": 0, "progress": 0, "result_param2": 0}
        self.inbox.post("COMMAND_ACK", json.dumps({**ack, "target_system": 245, "target_component": 190}))
        asyncio.get_running_loop().call_later(0.05, self._beat, self.sent < self.obeys)

    def _beat(self, armed: bool) -> None:
        told = {"type": 2, "autopilot": 12, "system_status": 3, "mavlink_version": 3, "custom_mode": 0}
        self.inbox.post("HEARTBEAT", json.dumps({**told, "base_mode": 129 if armed else 1}))


@pytest.mark.parametrize("obeys", [1, 2, 3])
async def test_a_disarming_whose_answer_was_that_of_an_arming_is_commanded_again(obeys: int) -> None:
    vehicle = Armed(obeys)
    await vehicle.arming.disarm()
    assert vehicle.sent == obeys


async def test_a_vehicle_that_stays_armed_is_told() -> None:
    vehicle = Armed(obeys=4)
    with pytest.raises(LinkTimeoutError, match="HEARTBEAT does not report it"):
        await vehicle.arming.disarm()


async def test_a_process_that_stood_still_does_not_disarm_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.domain.vehicle.commands.LATE_S", 0.5)
    vehicle = Armed(obeys=2)
    vehicle.stands_still_s = 1.5
    with pytest.raises(LinkTimeoutError):
        await vehicle.arming.disarm()
    assert vehicle.sent == 1
