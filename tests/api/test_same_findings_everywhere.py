"""Command line, the page's own requests, jobs and REST say the same of a plan near the limits."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from structlog.testing import capture_logs
from typer.testing import Result

from app.domain.errors import WaydropError
from app.domain.vehicle.state import VehicleProfile
from tests.support.dispatch_commands import waydrop
from tests.support.near_the_limits import PLANS, VEHICLES, NearTheLimits
from tests.support.service_in_process import Service, run_service

PAIRS = [(near, vehicle) for near in PLANS for vehicle in near.vehicles]


@pytest.fixture(autouse=True)
def _quiet_service() -> Iterator[None]:
    """The service's log would go where the command writes: here they are one process."""
    with capture_logs():
        yield


@pytest.fixture
async def service(tmp_path: Path) -> AsyncIterator[Service]:
    """With one vehicle."""
    async with run_service(tmp_path, links=1) as running:
        yield running


@pytest.mark.parametrize("near", PLANS, ids=str)
async def test_without_a_vehicle(service: Service, tmp_path: Path, near: NearTheLimits) -> None:
    expected = {near.never} if near.never else set()
    file = _file(tmp_path, near)

    checked = await _post(service, "/plan-checks", plan=near.document)  # what the page asks while a plan is drawn
    assert (checked[0], _errors(checked[1])) == (200, expected)
    validated = await waydrop(service, "validate", file, "--json")
    assert json.loads(validated.stdout)["findings"] == checked[1]["findings"]
    assert validated.exit_code == (1 if expected else 0)

    stored = await service.call("POST", "/api/v1/plans", json=near.document)
    assert (stored[0], _errors(stored[2])) == ((422 if expected else 201), expected)
    assert stored[2]["findings"] == checked[1]["findings"]


@pytest.mark.parametrize(("near", "vehicle"), PAIRS, ids=[f"{near}, {vehicle}" for near, vehicle in PAIRS])
async def test_with_a_vehicle(service: Service, tmp_path: Path, near: NearTheLimits, vehicle: str) -> None:
    expected = {near.code_for(vehicle)} - {""}
    _become(service, VEHICLES[vehicle])
    file = _file(tmp_path, near)

    checked = await _post(service, "/plan-checks", plan=near.document, vehicle="v1")
    assert (checked[0], _errors(checked[1])) == (200, expected)
    validated = await waydrop(service, "validate", file, "--vehicle", "v1", "--json")
    assert json.loads(validated.stdout)["findings"] == checked[1]["findings"]
    assert validated.exit_code == (1 if expected else 0)

    judged = await _post(service, "/job-checks", plan=near.document, vehicle="v1", min_battery_percent=0)
    if judged[0] == 422:
        assert _errors(judged[1]) == expected == {near.never}
    else:
        (candidate,) = judged[1]["candidates"]
        assert {refusal["code"] for refusal in candidate["refusals"]} == expected

    run = await _run(service, near)
    assert (run[0], _errors(run[1])) == ((422 if expected else 202), expected)
    if expected:  # a run that is begun would be followed to its end
        flown = await waydrop(service, "fly", file, "--vehicle", "v1")
        assert _errors(_extra(flown)) == expected


async def test_the_command_line_says_that_it_depends_on_the_vehicle(service: Service, tmp_path: Path) -> None:
    low = next(near for near in PLANS if near.name == "takeoff to 3 m")
    shown = await waydrop(service, "validate", _file(tmp_path, low))
    assert shown.exit_code == 0
    assert "depends on the vehicle: a takeoff to 3 m above home is too low" in shown.stdout
    assert "assumed: NAV_ACC_RAD, firmware" in shown.stdout
    assert "1 finding depends on the vehicle: check it with --vehicle" in shown.stderr


async def _run(service: Service, near: NearTheLimits) -> tuple[int, Any]:
    """As the page and `fly` begin one: the plan is stored, then a run of it is asked for."""
    stored = await service.call("POST", "/api/v1/plans", json=near.document)
    if stored[0] != 201:
        return stored[0], stored[2]
    return await _post(service, "/runs", plan=stored[2]["id"], vehicle="v1")


def _become(service: Service, facts: VehicleProfile) -> None:
    (link,) = service.links
    link.facts = facts
    link.identity = replace(link.identity, vehicle_type=facts.vehicle_type, firmware=facts.firmware)


async def _post(service: Service, path: str, **body: Any) -> tuple[int, Any]:
    status, _, answer = await service.call("POST", f"/api/v1{path}", json=body)
    return status, answer


def _file(folder: Path, near: NearTheLimits) -> str:
    file = folder / "plan.json"
    file.write_text(json.dumps(near.document), encoding="utf-8")
    return str(file)


def _errors(answer: Any) -> set[str]:
    return {found["code"] for found in answer.get("findings", ()) if found["severity"] == "error"}


def _extra(result: Result) -> Any:
    assert isinstance(result.exception, WaydropError)
    return result.exception.extra
