"""The end of a run: a rover, which PX4 leaves armed, is disarmed; what would take off as it arms is put in Hold."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.domain.errors import VehicleRefusedError
from app.domain.events.run import CommandOutcome, RunAck, RunCommandName
from app.domain.run.run import RunState
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode, LandedState, MissionState
from tests.support.run_service import RunService, run_service
from tests.support.scripted_link import FAST


@pytest.fixture
async def driving() -> AsyncIterator[RunService]:
    """A rover on its way."""
    async with run_service("rover-drop.json") as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(landed=LandedState.IN_AIR, velocity_north_m_s=2.0)
        yield service


def _return_at_the_end(document: dict[str, Any]) -> None:
    document["items"][-1] = {"id": "home", "type": "return_to_launch"}


def _arrive(service: RunService, velocity_north_m_s: float = 0.0) -> None:
    """PX4 goes over to Hold, armed."""
    last, complete = len(service.mission.items) - 1, MissionState.COMPLETE
    service.vehicle.put(mission_seq=last)
    service.vehicle.put(mission_state=complete, velocity_north_m_s=velocity_north_m_s, mode=FlightMode.HOLD)


def _answers(service: RunService, command: RunCommandName = RunCommandName.DISARM) -> list[RunAck]:
    said = [event.data for event in service.events.events if isinstance(event.data, RunAck)]
    return [ack for ack in said if ack.command is command]


async def test_a_rover_is_disarmed_before_its_run_is_over_and_can_be_started_again(driving: RunService) -> None:
    _arrive(driving)
    await driving.until_state(RunState.COMPLETED)
    assert driving.vehicle.truth.armed is False
    assert [ack.outcome for ack in _answers(driving)] == [CommandOutcome.DONE]
    driving.vehicle.put(mission_state=MissionState.NOT_STARTED, landed=LandedState.ON_GROUND)
    await driving.until(lambda: all(run.is_over for run in driving.runs.open_runs()), "its end is stored")
    await driving.create()
    await driving.until_state(RunState.FLYING)


@pytest.mark.parametrize(
    ("mode", "in_failsafe"),
    [(FlightMode.POSITION, False), (FlightMode.MANUAL, False), (FlightMode.OFFBOARD, False), (FlightMode.HOLD, True)],
)
async def test_a_rover_that_somebody_took_as_it_arrived_is_not_disarmed(
    driving: RunService, mode: FlightMode, in_failsafe: bool
) -> None:
    _arrive(driving, velocity_north_m_s=1.0)
    await driving.until(lambda: driving.flight.flight.mission_done, "it must have arrived")
    driving.vehicle.put(mode=mode, in_failsafe=in_failsafe, velocity_north_m_s=0.0)
    await driving.until_state(RunState.COMPLETED)
    assert "disarm" not in driving.vehicle.sent


async def test_a_rover_that_a_person_drove_on_after_its_end_is_not_disarmed_where_it_stops(driving: RunService) -> None:
    """In Hold mode it looks as if it had never been taken."""
    _arrive(driving, velocity_north_m_s=1.0)
    await driving.until(lambda: driving.flight.flight.mission_done, "it must have arrived")
    driving.vehicle.put(mode=FlightMode.MANUAL)
    await driving.until_state(RunState.PAUSED)
    driving.vehicle.put(mode=FlightMode.HOLD, velocity_north_m_s=0.0)
    await driving.until_state(RunState.COMPLETED)
    assert "disarm" not in driving.vehicle.sent


async def test_a_rover_that_drives_away_again_is_not_disarmed_and_its_run_is_over(driving: RunService) -> None:
    driving.vehicle.disarm_gate.clear()
    _arrive(driving)
    await driving.until(lambda: "disarm" in driving.vehicle.sent, "it must be disarmed")
    driving.vehicle.put(mode=FlightMode.MISSION, mission_seq=0, velocity_north_m_s=2.0)
    await driving.until_state(RunState.COMPLETED)
    driving.vehicle.disarm_gate.set()
    assert driving.vehicle.truth.armed is True


async def test_a_rover_that_returns_at_the_end_is_left_to_its_autopilot() -> None:
    """It stands at its last drop as its return begins, for a moment still in Mission mode, then in Return mode."""
    async with run_service("rover-drop.json", changes=_return_at_the_end) as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(landed=LandedState.IN_AIR, velocity_north_m_s=0.0)
        last = len(service.mission.items) - 1
        service.vehicle.put(ItemReached(last), mission_seq=last, mission_state=MissionState.COMPLETE)
        await service.until(lambda: service.flight.flight.mission_done, "its items are done")
        service.vehicle.put(mode=FlightMode.RETURN)
        await service.until_state(RunState.RETURNING)
        assert "disarm" not in service.vehicle.sent
        service.vehicle.put(armed=False, landed=LandedState.ON_GROUND)
        await service.until_state(RunState.COMPLETED)


async def test_a_rover_that_a_person_has_paused_at_its_end_stays_armed(driving: RunService) -> None:
    await driving.flight.pause()
    _arrive(driving)
    await driving.until_state(RunState.COMPLETED)
    assert "disarm" not in driving.vehicle.sent


async def test_a_rover_that_does_not_disarm_is_asked_once_and_its_run_ends(
    monkeypatch: pytest.MonkeyPatch, driving: RunService
) -> None:
    monkeypatch.setattr("app.domain.flight.step.DISARMED_WITHIN_S", FAST.poll_every_s * 5)
    driving.vehicle.disarm_error = VehicleRefusedError("the vehicle refused to disarm: DENIED")
    _arrive(driving)
    await driving.until_state(RunState.COMPLETED)
    assert driving.vehicle.sent.count("disarm") == 1
    assert [ack.outcome for ack in _answers(driving)] == [CommandOutcome.FAILED]


async def test_a_disarming_is_broken_off_when_somebody_takes_the_rover_meanwhile(driving: RunService) -> None:
    driving.vehicle.disarm_gate.clear()
    _arrive(driving)
    await driving.until(lambda: "disarm" in driving.vehicle.sent, "it must be disarmed")
    driving.vehicle.put(mode=FlightMode.MANUAL, velocity_north_m_s=3.0)
    await driving.until_state(RunState.COMPLETED)
    driving.vehicle.disarm_gate.set()
    await asyncio.sleep(FAST.poll_every_s * 3)
    assert driving.vehicle.truth.armed is True
    assert [ack.outcome for ack in _answers(driving)] == [CommandOutcome.UNKNOWN]


async def _in_the_air(service: RunService) -> None:
    await service.create()
    await service.until_state(RunState.FLYING)
    service.vehicle.put(landed=LandedState.IN_AIR, relative_altitude_m=15.0)
    await service.until(lambda: service.flight.flight.was_airborne, "it must be seen in the air")


@pytest.mark.parametrize("problem", [None, VehicleRefusedError("no")])
async def test_a_vehicle_that_would_take_off_as_it_arms_is_left_in_hold(problem: VehicleRefusedError | None) -> None:
    async with run_service("multicopter-embedded.json") as service:
        await _in_the_air(service)
        service.vehicle.hold_error = problem
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        service.vehicle.put(mode=FlightMode.MISSION)  # PX4, as it disarms
        await service.until_state(RunState.COMPLETED)
        await service.until(lambda: bool(_answers(service, RunCommandName.HOLD)), "Hold must be commanded")
        outcome = CommandOutcome.DONE if problem is None else CommandOutcome.FAILED
        assert [ack.outcome for ack in _answers(service, RunCommandName.HOLD)] == [outcome]
        assert service.vehicle.sent[-1] == "hold_disarmed"


async def test_a_vehicle_that_landed_in_another_mode_is_left_in_it() -> None:
    async with run_service("multicopter-embedded.json") as service:
        await _in_the_air(service)
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        await service.until_state(RunState.COMPLETED)
        await service.until(lambda: not service.runs.open_runs(), "its vehicle is let go")
        assert "hold_disarmed" not in service.vehicle.sent


async def test_a_hold_at_the_end_that_is_broken_off_is_told_as_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    never = asyncio.Event()

    async def hold_disarmed() -> None:
        await never.wait()

    async with run_service("multicopter-embedded.json") as service:
        await _in_the_air(service)
        monkeypatch.setattr(service.vehicle, "hold_disarmed", hold_disarmed)
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        service.vehicle.put(mode=FlightMode.MISSION)
        await service.until(lambda: "run.command" in service.kinds()[-1:], "Hold must be commanded")
        await service.runs.close()
        assert [ack.outcome for ack in _answers(service, RunCommandName.HOLD)] == [CommandOutcome.UNKNOWN]
