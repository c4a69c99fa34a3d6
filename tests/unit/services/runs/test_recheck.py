"""A plan that was checked against older parameters is checked again at the start, before the vehicle is armed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.errors import PlanRejectedError
from app.domain.events import EventKind
from app.domain.events.run import RunChanged
from app.domain.reasons import describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import GlobalPosition
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


def told_at_start(service: RunService) -> list[str]:
    """The reasons with which it was starting, in order."""
    changed = [event.data.root for event in service.events.events if isinstance(event.data, RunChanged)]
    return [describe(run.reason) for run in changed if run.state is RunState.STARTING]


async def test_a_start_tells_the_warnings_that_the_plan_did_not_have_as_its_run_was_created() -> None:
    async with run_service() as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        set_parameter(service, "GF_ACTION", 0.0)
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)
        (first, new) = told_at_start(service)
        assert first == ""
        assert new.startswith(
            "checked again at the start, the plan has new warnings: at this geofence the vehicle flies on"
        )
        assert service.run.reason is None, "it flies all the same"


async def test_a_start_does_not_repeat_the_warnings_of_before() -> None:
    async with run_service() as service:
        set_parameter(service, "GF_ACTION", 0.0)
        await service.create()
        await service.until_state(RunState.FLYING)
        assert told_at_start(service) == [""]


def above_sea(document: dict[str, object]) -> None:
    """Four waypoints at a height above the sea."""
    items = document["items"]
    assert isinstance(items, list)
    for item in items[1:3]:
        del item["relative_altitude_m"]
        item["absolute_altitude_m"] = 503.0
    items[1:2] = [{**items[1], "id": f"corner-{number}"} for number in range(3)]


async def test_a_start_tells_three_of_many_warnings_and_how_many_more() -> None:
    async with run_service(changes=above_sea) as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        home = GlobalPosition(47.397742, 8.545594, 504.0)
        service.vehicle.facts = replace(service.vehicle.facts, home=home)
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)
        three = "; ".join(f"corner-{number}: 1 m below home" for number in range(3))
        assert told_at_start(service)[-1].endswith(f"warnings: {three}; and 1 more")
