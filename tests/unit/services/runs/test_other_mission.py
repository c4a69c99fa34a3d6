"""What users may command while another client's mission is on board."""

from __future__ import annotations

import pytest

from app.domain.errors import ConflictError
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode
from tests.support.changed_flight import clinic_moved, fly, store
from tests.support.run_service import RunService, run_service

OTHER_ON_BOARD = Reason.of(ReasonCode.OTHER_MISSION_ON_BOARD)


async def replaced(service: RunService) -> None:
    await fly(service)
    service.vehicle.put(mission_id=service.vehicle.truth.mission_id + 1)
    await service.until(lambda: service.run.reason == OTHER_ON_BOARD, "it is seen")
    assert service.run.state is RunState.PAUSED


async def test_another_mission_is_not_resumed() -> None:
    async with run_service() as service:
        await replaced(service)
        await service.runs.pause(service.run_id)
        await service.until(lambda: service.run.reason != OTHER_ON_BOARD, "it holds")
        sent = list(service.vehicle.sent)
        with pytest.raises(ConflictError, match="another mission"):
            await service.runs.resume(service.run_id)
        assert service.vehicle.sent == sent


async def test_a_change_is_not_sent_over_another_mission() -> None:
    async with run_service() as service:
        await replaced(service)
        await service.runs.pause(service.run_id)
        await service.until(lambda: service.run.reason != OTHER_ON_BOARD, "it holds")
        with pytest.raises(ConflictError, match="another mission"):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")


async def test_the_vehicle_is_still_returned() -> None:
    async with run_service() as service:
        await replaced(service)
        await service.runs.return_to_launch(service.run_id)
        service.vehicle.put(mode=FlightMode.RETURN)
        await service.until_state(RunState.RETURNING)
