"""A run is refused for a vehicle whose battery would not last: as it is made, and again as it is started."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.errors import PlanRejectedError, WrongStateError
from app.domain.events import EventKind
from app.domain.prediction import Wind
from app.domain.run.run import RunState
from app.domain.vehicle.performance import Performance
from tests.support.busy_pool import busy_default_pool
from tests.support.events import data_of
from tests.support.gated_plans import codes
from tests.support.run_service import run_service

PATIENCE_S = 30.0
THIRSTY = Performance(battery_percent_per_min=10.0, reserve_percent=20.0)


async def test_a_run_needs_a_battery_that_lasts() -> None:
    async with run_service(performance=THIRSTY) as service:
        service.vehicle.put(battery_percent=30.0)
        with pytest.raises(PlanRejectedError) as refused:
            await service.create()
        assert "battery.reserve_at_home" in codes(refused.value)
        service.vehicle.put(battery_percent=95.0)
        assert (await service.create(start=False)).state is RunState.CREATED


async def test_a_battery_that_emptied_while_the_run_waited_keeps_it_from_starting() -> None:
    async with run_service(performance=THIRSTY) as service:
        service.vehicle.put(battery_percent=95.0)
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        service.vehicle.put(battery_percent=30.0)
        with pytest.raises(PlanRejectedError) as refused:
            await service.runs.start(service.run_id)
        assert "battery.reserve_at_home" in codes(refused.value)
        assert service.run.state is RunState.UPLOADED
        service.vehicle.put(battery_percent=95.0)
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)
        with pytest.raises(WrongStateError):
            await service.runs.start(service.run_id)


async def test_no_gate_of_a_run_waits_for_the_work_of_others() -> None:
    async with run_service() as service, busy_default_pool() as other, asyncio.timeout(PATIENCE_S):
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)
        assert not other.done()


async def test_a_run_keeps_the_wind_that_it_was_checked_with() -> None:
    async with run_service(performance=THIRSTY) as service:
        wind = Wind(north_m_s=3.0)
        run = await service.runs.create("plan-1", "v1", start=False, actor="test", wind=wind)
        assert run.wind == wind
        (predicted,) = [event for event in service.events.events if event.kind is EventKind.RUN_PREDICTED]
        assert data_of(predicted)["wind"] == {"north_m_s": 3.0, "east_m_s": 0.0, "given": True}
        assert data_of(predicted)["battery_used_percent"] > 0.0
