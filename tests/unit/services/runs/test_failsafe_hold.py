"""PX4 holds for some seconds before a failsafe acts, and gives it up for any mode that is commanded meanwhile."""

from __future__ import annotations

import pytest

from app.domain.errors import VehicleInFailsafeError
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode
from tests.support.changed_flight import fly
from tests.support.run_service import RunService, run_service

ABOUT_TO_ACT = Reason.of(ReasonCode.FAILSAFE_MODE, mode="hold")


async def held_by_failsafe(service: RunService) -> None:
    await fly(service)
    service.vehicle.put(mode=FlightMode.HOLD, in_failsafe=True, failsafe_delay_s=1.0)
    await service.until(lambda: service.run.reason == ABOUT_TO_ACT, "the failsafe shows")


@pytest.mark.parametrize("action", ["pause", "resume"])
async def test_neither_hold_nor_the_mission_is_commanded_then(action: str) -> None:
    async with run_service() as service:
        await held_by_failsafe(service)
        sent = list(service.vehicle.sent)
        with pytest.raises(VehicleInFailsafeError):
            await getattr(service.runs, action)(service.run_id)
        assert service.vehicle.sent == sent
        assert (service.run.state, service.run.reason) == (RunState.PAUSED, ABOUT_TO_ACT)
        service.vehicle.put(mode=FlightMode.RETURN, failsafe_delay_s=None)
        await service.until_state(RunState.RETURNING)
        assert service.run.reason == Reason.of(ReasonCode.FAILSAFE)


@pytest.mark.parametrize(("action", "mode"), [("return_to_launch", "return"), ("land", "land")])
async def test_a_way_out_is_commanded_all_the_same(action: str, mode: str) -> None:
    async with run_service() as service:
        await held_by_failsafe(service)
        await getattr(service.runs, action)(service.run_id)
        assert service.vehicle.sent[-1] == mode


async def test_once_the_failsafe_is_over_the_mission_is_resumed() -> None:
    async with run_service() as service:
        await held_by_failsafe(service)
        service.vehicle.put(in_failsafe=False, failsafe_delay_s=None)
        await service.runs.resume(service.run_id)
        await service.until_state(RunState.FLYING)


async def test_a_hold_that_is_all_that_the_failsafe_does_is_left_by_the_user() -> None:
    async with run_service() as service:
        await held_by_failsafe(service)
        service.vehicle.put(failsafe_delay_s=9.0)
        await service.runs.resume(service.run_id)
        await service.until_state(RunState.FLYING)
