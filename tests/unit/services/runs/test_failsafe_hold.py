"""PX4 holds for some seconds before a failsafe acts, and gives it up for any mode that is commanded meanwhile."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.errors import ConflictError, VehicleInFailsafeError
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


async def paused_amid_return(service: RunService, battery_percent: float | None) -> None:
    """Its battery lets it return, and a user pauses that (flown)."""
    acts = {**service.vehicle.facts.parameters, "COM_LOW_BAT_ACT": 3, "BAT_CRIT_THR": 0.07}
    service.vehicle.facts = replace(service.vehicle.facts, parameters=acts)
    await fly(service)
    service.vehicle.put(mode=FlightMode.RETURN, in_failsafe=True, battery_percent=battery_percent)
    await service.until(lambda: service.run.reason == Reason.of(ReasonCode.FAILSAFE), "the failsafe shows")
    await service.runs.pause(service.run_id)
    service.vehicle.put(in_failsafe=False)
    await service.until(lambda: service.run.reason == CANCELLED, "the run says what the pause has done")


CANCELLED = Reason.of(ReasonCode.PAUSED_AMID_FAILSAFE, Reason.of(ReasonCode.FAILSAFE))


async def test_a_mission_is_not_flown_on_with_a_battery_at_which_the_cancelled_failsafe_acted() -> None:
    async with run_service() as service:
        await paused_amid_return(service, 6.0)
        sent = list(service.vehicle.sent)
        with pytest.raises(ConflictError, match="6 %"):
            await service.runs.resume(service.run_id)
        assert (service.vehicle.sent, service.run.state) == (sent, RunState.PAUSED)
        await service.runs.return_to_launch(service.run_id)
        assert service.vehicle.sent[-1] == "return"


@pytest.mark.parametrize("battery_percent", [None, 8.0])
async def test_with_a_battery_that_is_not_known_to_be_critical_it_is(battery_percent: float | None) -> None:
    async with run_service() as service:
        await paused_amid_return(service, battery_percent)
        await service.runs.resume(service.run_id)
        await service.until_state(RunState.FLYING)
        assert service.run.reason is None
