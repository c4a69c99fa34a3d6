"""Disarming is believed when a HEARTBEAT shows it: its acknowledgement cannot be told from that of an arming."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import Sequence
from dataclasses import replace

import pytest

from app.domain.errors import CommandExpiredError, LinkTimeoutError, VehicleRefusedError, VehicleTakenError
from app.vehicles.command_sender import CommandSender
from app.vehicles.decoders import EventReport, StatusTextChunk
from app.vehicles.encoders import Outgoing
from app.vehicles.inbox import Inbox
from app.vehicles.modes import Arming
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

SETTINGS = LinkSettings(command_timeout_s=3.0, mode_seen_timeout_s=10.0, command_attempts=3, refusal_text_window_s=0.01)
"""Answers and HEARTBEATs come within 0.2 s, or later on a busy machine."""
UNANSWERED = replace(SETTINGS, command_timeout_s=0.1)
ACCEPTED, TEMPORARILY_REJECTED = 0, 1
HOLD = 50593792
"""PX4's custom_mode: main mode 4, sub mode 3."""


def stand_still(seconds: float) -> None:
    """The whole process, as under SIGSTOP."""
    time.sleep(seconds)


class Armed:
    """An armed vehicle that answers each disarming with these results, and obeys the one of this number."""

    def __init__(self, obeys: int, results: Sequence[int | None] = (), *, settings: LinkSettings = SETTINGS) -> None:
        self.obeys = obeys
        self.results = iter(results)
        self.sent = 0
        self.stands_still_s = 0.0
        self.inbox = Inbox(asyncio.get_running_loop(), capacity=64)
        self.texts = StatusTexts(lambda text: None)
        sender = CommandSender(self._take, self.inbox, self.texts, 245)
        self.arming = Arming(sender, self.inbox, settings)

    def _take(self, _message: Outgoing) -> None:
        self.sent += 1
        stand_still(self.stands_still_s)
        result = next(self.results, ACCEPTED)
        if result is not None:
            ack = {"command": 400, "result": result, "progress": 0, "result_param2": 0}
            self.inbox.post("COMMAND_ACK", json.dumps({**ack, "target_system": 245, "target_component": 190}))
        asyncio.get_running_loop().call_later(0.15, self.beat, self.sent < self.obeys)

    def beat(self, armed: bool) -> None:
        """One HEARTBEAT, in Hold."""
        told = {"type": 2, "autopilot": 12, "system_status": 3, "mavlink_version": 3, "custom_mode": HOLD}
        self.inbox.post("HEARTBEAT", json.dumps({**told, "base_mode": 129 if armed else 1}))


@pytest.mark.parametrize("obeys", [1, 2, 3])
async def test_a_disarming_whose_answer_was_that_of_an_arming_is_commanded_again(obeys: int) -> None:
    vehicle = Armed(obeys)
    await vehicle.arming.disarm()
    assert vehicle.sent == obeys


async def test_the_late_refusal_of_an_arming_is_no_answer_to_the_disarming() -> None:
    vehicle = Armed(obeys=1, results=[TEMPORARILY_REJECTED])
    await vehicle.arming.disarm()
    assert vehicle.sent == 1


async def test_a_flying_vehicle_refuses_to_be_disarmed() -> None:
    vehicle = Armed(obeys=4, results=[TEMPORARILY_REJECTED] * 3)
    with pytest.raises(VehicleRefusedError):
        await vehicle.arming.disarm()
    assert vehicle.sent == 2, "the first refusal may be that of an arming"


async def test_a_disarming_that_is_obeyed_and_never_answered_is_done() -> None:
    vehicle = Armed(obeys=1, results=[None, None, None], settings=UNANSWERED)
    await vehicle.arming.disarm()
    assert vehicle.sent == 3, "a HEARTBEAT without an answer may have been under way"


async def test_an_arming_that_is_not_sent_does_not_count_as_sent() -> None:
    vehicle, left = Armed(obeys=1), asyncio.Event()
    arming = asyncio.create_task(vehicle.arming.arm(left.set))
    await asyncio.sleep(0)
    vehicle.beat(armed=False)
    stand_still(0.5)  # the HEARTBEAT is too old when it is read
    with pytest.raises(CommandExpiredError):
        await arming
    assert (vehicle.sent, left.is_set()) == (0, False)


@pytest.mark.parametrize("older", [True, False])
async def test_a_heartbeat_from_now_on_shows_that_it_is_armed(older: bool) -> None:
    vehicle = Armed(obeys=1)
    vehicle.beat(armed=older)
    await asyncio.sleep(0)
    waiting = asyncio.create_task(vehicle.arming.until_armed())
    await asyncio.sleep(0)
    assert not waiting.done()
    vehicle.beat(armed=True)
    await waiting


async def test_one_that_was_under_way_before_the_arming_is_waited_out() -> None:
    vehicle = Armed(obeys=1)
    waiting = asyncio.create_task(vehicle.arming.until_armed())
    await asyncio.sleep(0)
    vehicle.beat(armed=False)
    vehicle.beat(armed=True)
    await waiting


async def test_a_vehicle_that_goes_on_reporting_disarmed_was_disarmed_by_somebody_else() -> None:
    vehicle = Armed(obeys=1)
    waiting = asyncio.create_task(vehicle.arming.until_armed())
    while not waiting.done():
        vehicle.beat(armed=False)
        await asyncio.sleep(0.05)
    with pytest.raises(VehicleTakenError, match="disarmed again, not by Waydrop") as caught:
        await waiting
    assert caught.value.extra == {"mode": "hold", "armed": False, "texts": ()}


async def test_without_a_heartbeat_nobody_knows_whether_it_is_armed() -> None:
    vehicle = Armed(obeys=1, settings=replace(SETTINGS, mode_seen_timeout_s=0.1))
    with pytest.raises(LinkTimeoutError, match="no HEARTBEAT within"):
        await vehicle.arming.until_armed()


@pytest.mark.parametrize(("attempts", "told"), [(1, "1 attempt without"), (3, "3 attempts without")])
async def test_all_attempts_without_an_answer_are_counted(attempts: int, told: str) -> None:
    vehicle = Armed(obeys=4, results=[None] * 3, settings=replace(UNANSWERED, command_attempts=attempts))
    with pytest.raises(LinkTimeoutError, match=told):
        await vehicle.arming.disarm()
    assert vehicle.sent == attempts


async def test_a_refused_arming_is_explained_by_the_checks_that_fail_and_not_by_those_of_other_modes() -> None:
    vehicle = Armed(obeys=1, results=[TEMPORARILY_REJECTED])
    for event_id, modes in ((28241790, 0x4000), (30612409, 0x7E00FC)):
        vehicle.texts.take_event(EventReport(event_id, modes.to_bytes(4, "little")), time.monotonic())
    vehicle.texts.take(StatusTextChunk(2, "Preflight Fail: GPS fix too low", 0, 0), time.monotonic())
    vehicle.texts.take(StatusTextChunk(4, "Preflight: Strong magnetic interference", 0, 0), time.monotonic())
    arming = asyncio.create_task(vehicle.arming.arm(lambda: None))
    await asyncio.sleep(0)
    vehicle.texts.take(StatusTextChunk(4, "Preflight: Strong magnetic interference", 0, 0), math.inf)
    vehicle.texts.take(StatusTextChunk(2, "Arming denied: Resolve system health failures first", 0, 0), math.inf)
    vehicle.beat(armed=False)
    with pytest.raises(VehicleRefusedError) as refused:
        await arming
    assert refused.value.extra["texts"] == (
        "Arming denied: Resolve system health failures first",
        "Navigation error: No valid position estimate",
        "Preflight Fail: GPS fix too low",
    )
    assert refused.value.detail.endswith("No valid position estimate; Preflight Fail: GPS fix too low")


async def test_a_vehicle_that_stays_armed_is_told() -> None:
    vehicle = Armed(obeys=4)
    with pytest.raises(LinkTimeoutError, match="HEARTBEAT does not report it"):
        await vehicle.arming.disarm()


async def test_a_process_that_stood_still_does_not_disarm_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.domain.vehicle.commands.LATE_S", 0.5)
    vehicle = Armed(obeys=2, settings=UNANSWERED)
    vehicle.stands_still_s = 1.5
    with pytest.raises(LinkTimeoutError):
        await vehicle.arming.disarm()
    assert vehicle.sent == 1
