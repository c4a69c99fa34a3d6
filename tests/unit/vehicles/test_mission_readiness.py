"""When an uploaded mission counts as taken: on the ground, and in flight, where an infeasible one shows late."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import pytest

from app.domain.errors import LinkTimeoutError, VehicleRefusedError
from app.vehicles.decoders import EventReport, GlobalPositionInt, Heartbeat, MissionCurrentReport, StatusTextChunk
from app.vehicles.inbox import Inbox
from app.vehicles.measurements import Measurements
from app.vehicles.mission_readiness import MissionReadiness
from app.vehicles.mission_upload import MissionUploader, UploadRecord
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

NO_MISSION, NOT_STARTED, ACTIVE = 1, 2, 3
OURS, BEFORE = 77, 66


class Waiting:
    """One upload that was acknowledged a minute ago; reports come as long after its ack as the test says."""

    def __init__(self, *, armed: bool, clock_rate: float = 1.0) -> None:
        self.measurements = Measurements()
        self._acked_s = time.monotonic() - 60.0
        self._handlers: list[Callable[[MissionCurrentReport, float], None]] = []
        self.measurements.take_heartbeat(heartbeat(armed=armed), self._acked_s)
        for quarter in range(16):  # four seconds of position reports
            at_s = quarter / 4
            self.measurements.take_position(position(round(at_s * clock_rate * 1e3)), self._acked_s + at_s)
        self.texts = StatusTexts(lambda _text: None)
        uploader = SimpleNamespace(last=UploadRecord((), OURS, self._acked_s - 1.0, self._acked_s))
        self.readiness = MissionReadiness(
            self.measurements,
            cast(Inbox, self),
            self.texts,
            cast(MissionUploader, uploader),
            LinkSettings(),
        )

    def on(self, _kind: type, handler: Callable[[MissionCurrentReport, float], None]) -> Callable[[], None]:
        """As Inbox.on."""
        self._handlers.append(handler)
        return lambda: self._handlers.remove(handler)

    async def report(self, after_ack_s: float, state: int, mission_id: int = OURS) -> None:
        """A MISSION_CURRENT, and a turn for whoever waits for it."""
        message = MissionCurrentReport(0, 3, state, 1, mission_id, 0, 0)
        self.measurements.take_mission(message, self._acked_s + after_ack_s)
        for handler in tuple(self._handlers):
            handler(message, self._acked_s + after_ack_s)
        for _ in range(5):
            await asyncio.sleep(0)

    def begin(self, timeout_s: float = 10.0) -> asyncio.Task[None]:
        """Somebody waits for it."""
        return asyncio.create_task(self.readiness.wait(mission_id=OURS, rerun=False, timeout_s=timeout_s))


def heartbeat(*, armed: bool) -> Heartbeat:
    return Heartbeat(type=2, autopilot=12, base_mode=0x80 if armed else 0, custom_mode=0, system_status=4)


def position(time_boot_ms: int) -> GlobalPositionInt:
    return GlobalPositionInt(time_boot_ms, 0, 0, 0, 0, 0, 0, 0, 0)


async def test_in_flight_a_mission_is_taken_when_it_still_shows_as_active_a_second_later() -> None:
    vehicle = Waiting(armed=True)
    waits = vehicle.begin()
    await vehicle.report(0.1, ACTIVE)
    await vehicle.report(0.9, ACTIVE)
    assert not waits.done(), "PX4 may not have looked at it yet"
    await vehicle.report(1.0, ACTIVE)
    await asyncio.wait_for(waits, 10.0)


async def test_in_flight_a_mission_that_shows_as_infeasible_late_is_refused() -> None:
    vehicle = Waiting(armed=True)
    waits = vehicle.begin()
    for after_s, state in ((0.1, ACTIVE), (0.9, ACTIVE), (1.9, NO_MISSION), (2.9, NO_MISSION)):
        assert not waits.done()
        await vehicle.report(after_s, state)
    with pytest.raises(VehicleRefusedError, match="infeasible"):
        await asyncio.wait_for(waits, 10.0)


async def test_a_fast_simulation_is_not_waited_for_longer_than_a_second_of_its_own() -> None:
    vehicle = Waiting(armed=True, clock_rate=20.0)
    waits = vehicle.begin()
    await vehicle.report(0.02, ACTIVE)
    assert not waits.done()
    await vehicle.report(0.2, ACTIVE)
    await asyncio.wait_for(waits, 10.0)


async def test_on_the_ground_a_mission_is_taken_as_soon_as_it_shows_as_not_started() -> None:
    vehicle = Waiting(armed=False)
    waits = vehicle.begin()
    await vehicle.report(0.1, ACTIVE)
    await vehicle.report(0.2, NOT_STARTED, BEFORE)
    assert not waits.done(), "of an earlier mission"
    await vehicle.report(0.3, NOT_STARTED)
    await asyncio.wait_for(waits, 10.0)


async def test_a_vehicle_that_goes_on_naming_another_mission_is_told_as_such() -> None:
    vehicle = Waiting(armed=True)
    waits = vehicle.begin(timeout_s=0.05)
    await vehicle.report(5.0, ACTIVE, BEFORE)
    with pytest.raises(LinkTimeoutError, match="reports mission 66 instead of 77"):
        await waits


@pytest.mark.parametrize("armed", [False, True])
async def test_a_mission_of_another_client_that_stays_on_board_is_told_at_once_with_what_to_do(armed: bool) -> None:
    vehicle = Waiting(armed=armed)
    waits = vehicle.begin()
    for second in range(4):
        assert not waits.done(), "MISSION_CURRENT may be behind"
        await vehicle.report(30.0 + second, ACTIVE if armed else NOT_STARTED, BEFORE)
    with pytest.raises(VehicleRefusedError, match=r"another mission is on board: .* 66 instead of 77") as refused:
        await asyncio.wait_for(waits, 1.0)
    assert "another client uploaded it" in refused.value.hint
    assert ("create the run again" in refused.value.hint) is not armed, "in flight the run goes on"


async def test_another_mission_that_was_on_board_before_for_less_than_three_seconds_is_waited_for() -> None:
    vehicle = Waiting(armed=False)
    waits = vehicle.begin()
    for after_s in (0.1, 1.1, 2.1, 3.0):
        await vehicle.report(after_s, NOT_STARTED, BEFORE)
    await vehicle.report(3.2, NOT_STARTED)
    await asyncio.wait_for(waits, 1.0)


@pytest.mark.parametrize("shown", [(NOT_STARTED, 65), (NO_MISSION, BEFORE), (0, BEFORE)])
async def test_only_one_and_the_same_complete_mission_counts_as_another_one_on_board(shown: tuple[int, int]) -> None:
    vehicle = Waiting(armed=False)
    waits = vehicle.begin(timeout_s=0.5)
    for second in range(12):
        state, mission_id = shown if second % 2 else (NOT_STARTED, BEFORE)
        await vehicle.report(30.0 + second, state, mission_id)
    with pytest.raises(LinkTimeoutError, match="instead of 77"):
        await waits


async def test_an_infeasible_mission_is_explained_by_what_is_about_the_mission_alone() -> None:
    """PX4 sends its health report anew at each upload: "No offboard signal" says nothing of the mission."""
    vehicle = Waiting(armed=False)
    for event_id in (28241790, 33440290):
        vehicle.texts.take_event(EventReport(event_id, b""), time.monotonic())
    waiting = vehicle.begin()
    await vehicle.report(30.0, 1)
    with pytest.raises(VehicleRefusedError) as refused:
        await waiting
    assert refused.value.extra["texts"] == ("Mission rejected: takeoff is not the first waypoint item",)
    assert "No offboard signal" not in refused.value.detail


async def test_a_mission_that_only_the_vehicles_health_makes_infeasible_is_no_fault_of_the_plan() -> None:
    vehicle = Waiting(armed=False)
    vehicle.texts.take_event(EventReport(30612409, (1 << 3).to_bytes(4, "little")), time.monotonic())
    vehicle.texts.take(StatusTextChunk(4, "Preflight: Strong magnetic interference", 0, 0), time.monotonic())
    waiting = vehicle.begin()
    await vehicle.report(30.0, NO_MISSION)
    with pytest.raises(VehicleRefusedError) as refused:
        await waiting
    assert refused.value.extra["texts"] == ("Navigation error: No valid position estimate",)
    assert "health checks" in refused.value.hint
