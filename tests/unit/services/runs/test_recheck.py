"""A plan that was checked against older parameters is checked again at the start, before the vehicle is armed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.errors import PlanRejectedError
from app.domain.events import EventKind
from app.domain.reasons import describe
from app.domain.run.run import RunState
from tests.support.events import data_of
from tests.support.run_service import RunService, run_service

LANDING_REQUIRED = 3


def set_parameter(service: RunService, name: str, value: float) -> None:
    facts = service.vehicle.facts
    service.vehicle.facts = replace(facts, parameters={**facts.parameters, name: value}, parameters_age_s=0.5)


def commands(service: RunService) -> list[object]:
    return [data_of(event)["command"] for event in service.events.events if event.kind is EventKind.RUN_COMMAND]


async def test_a_start_that_the_parameters_forbid_now_is_refused_with_its_findings() -> None:
    async with run_service() as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        set_parameter(service, "MIS_TKO_LAND_REQ", LANDING_REQUIRED)
        with pytest.raises(PlanRejectedError) as refused:
            await service.runs.start(service.run_id)
        findings = refused.value.extra["findings"]
        assert isinstance(findings, list)
        assert "landing.required" in {finding["code"] for finding in findings}
        assert service.run.state is RunState.UPLOADED


async def test_parameters_that_change_during_the_upload_fail_the_start_before_arming() -> None:
    async with run_service() as service:
        service.vehicle.upload_gate.clear()
        await service.create(start=True)
        await service.until_state(RunState.UPLOADING)
        set_parameter(service, "MIS_TKO_LAND_REQ", LANDING_REQUIRED)
        service.vehicle.upload_gate.set()
        await service.until_state(RunState.FAILED)
        assert commands(service) == []
        told = next(data_of(event) for event in service.events.events if event.kind is EventKind.RUN_PLAN_REFUSED)
        assert told["code"] == "plan.rejected"
        assert told["parameters_age_s"] == 0.5
        assert "landing.required" in {finding["code"] for finding in told["findings"]}


async def test_a_mission_that_would_be_compiled_otherwise_now_is_not_started() -> None:
    """An embedded drop's hold is as long as the gripper takes."""
    async with run_service("multicopter-embedded.json") as service:
        service.vehicle.upload_gate.clear()
        await service.create(start=True)
        await service.until_state(RunState.UPLOADING)
        set_parameter(service, "PD_GRIPPER_TO", 7.0)
        service.vehicle.upload_gate.set()
        await service.until_state(RunState.FAILED)
        assert "parameters changed since the upload" in describe(service.run.reason)
        assert commands(service) == []
