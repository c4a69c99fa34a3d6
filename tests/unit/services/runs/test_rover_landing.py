"""A run whose rover is landed on its way: it stops in Hold first, and nobody else is blamed for that."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from app.domain.errors import ConflictError
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.events import data_of
from tests.support.run_service import RunService, run_service

AS_ASKED = Reason.of(ReasonCode.LANDING_AS_ASKED)


@pytest.fixture
async def driving() -> AsyncIterator[RunService]:
    """A rover on its way."""
    async with run_service("rover-drop.json") as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(landed=LandedState.IN_AIR, velocity_north_m_s=2.9)
        yield service


async def test_a_rover_is_landing_as_asked_while_it_stops(driving: RunService) -> None:
    landing = asyncio.create_task(driving.runs.land(driving.run_id))
    await driving.until(lambda: driving.vehicle.truth.mode is FlightMode.HOLD, "it must stop")
    await driving.until_state(RunState.RETURNING)
    assert driving.run.reason == AS_ASKED
    assert driving.vehicle.sent[-1] == "hold"
    driving.vehicle.put(velocity_north_m_s=0.0)
    await landing
    assert driving.vehicle.sent[-2:] == ["hold", "land"]
    driving.vehicle.put(armed=False, landed=LandedState.ON_GROUND)
    await driving.until_state(RunState.ABORTED)
    told = str([data_of(event) for event in driving.events.events])
    assert "run.taken_by_others" not in told
    assert "'paused'" not in told


async def test_a_rover_that_does_not_stop_is_paused_by_waydrop_and_can_go_on(
    monkeypatch: pytest.MonkeyPatch, driving: RunService
) -> None:
    monkeypatch.setattr("app.services.vehicle_commands.STOPS_WITHIN_S", 0.1)
    with pytest.raises(ConflictError, match="not seen to stop"):
        await driving.runs.land(driving.run_id)
    await driving.until_state(RunState.PAUSED)
    assert driving.run.reason == Reason.of(ReasonCode.PAUSED_AS_ASKED)
    assert driving.vehicle.sent[-1] == "hold"
    await driving.runs.resume(driving.run_id)
    await driving.until_state(RunState.FLYING)


@pytest.mark.parametrize(("command", "sent"), [("pause", "hold"), ("return_to_launch", "return"), ("abort", "return")])
async def test_another_command_does_not_wait_until_a_rover_has_stopped(
    driving: RunService, command: str, sent: str
) -> None:
    """Up to ten seconds. The landing is answered, too."""
    landing = asyncio.create_task(driving.runs.land(driving.run_id))
    await driving.until(lambda: driving.vehicle.truth.mode is FlightMode.HOLD, "it must stop")
    driving.vehicle.sent.clear()
    async with asyncio.timeout(5.0):
        await getattr(driving.runs, command)(driving.run_id)
    assert driving.vehicle.sent == [sent]
    with pytest.raises(ConflictError, match="another command"):
        await landing
    driving.vehicle.put(velocity_north_m_s=0.0)
    await driving.until_state(RunState.PAUSED if command == "pause" else RunState.RETURNING)
    assert "land" not in driving.vehicle.sent


async def test_a_second_landing_does_not_break_the_first_one_off(driving: RunService) -> None:
    first, second = (asyncio.create_task(driving.runs.land(driving.run_id)) for _ in range(2))
    await driving.until(lambda: driving.vehicle.truth.mode is FlightMode.HOLD, "it must stop")
    driving.vehicle.put(velocity_north_m_s=0.0)
    await asyncio.gather(first, second)
    assert driving.vehicle.sent[-3:] == ["hold", "land", "land"]
