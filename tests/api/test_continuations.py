"""Runs over REST that continue others: once, and only what is left."""

from __future__ import annotations

from typing import Any

from app.domain.errors import LinkTimeoutError
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, LandedState
from app.services.access import Role
from tests.support.run_changes import flying
from tests.support.runs_api import create, reaches
from tests.support.service_in_process import Service


async def ended(service: Service, plan: dict[str, Any]) -> dict[str, Any]:
    """A run that was sent home on the way to its drop, and landed."""
    run = await flying(service, plan, "clinic")
    await service.call("POST", f"/api/v1/runs/{run['id']}/return")
    await reaches(service, run["id"], "returning")
    service.links[0].change(armed=False, landed=LandedState.ON_GROUND, mode=FlightMode.HOLD, relative_altitude_m=0.0)
    return await reaches(service, run["id"], "aborted")


async def delivery_report(service: Service, run_id: str) -> dict[str, Any]:
    _, _, told = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    return dict(told)


async def sheet(service: Service, run_id: str) -> str:
    _, _, page = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    return str(page)


async def test_a_run_is_continued_once_by_a_run_of_what_is_left(service: Service, plan: dict[str, Any]) -> None:
    old = await ended(service, plan)
    path, key = f"/api/v1/runs/{old['id']}/continuation", {"Idempotency-Key": "continue-1"}
    status, headers, new = await service.call("POST", path, json={}, headers=key)
    assert (status, headers["Location"]) == (202, f"/api/v1/runs/{new['id']}")
    assert (new["continues"], new["start_requested"], new["vehicle_id"]) == (old["id"], False, "v1")
    _, _, made = await service.call("GET", f"/api/v1/plans/{new['plan_id']}")
    assert [item["id"] for item in made["plan"]["items"]] == ["takeoff", "clinic", "drop", "home"]
    assert made["hash"] == new["plan_hash"]
    _, _, again = await service.call("POST", path, json={}, headers=key)
    assert again["id"] == new["id"]
    status, _, problem = await service.call("POST", path, json={})
    assert (status, problem["code"], problem["continued_by"]) == (409, "run.continued", new["id"])
    _, _, was = await service.call("GET", f"/api/v1/runs/{old['id']}")
    assert (was["continued_by"], was["state"]) == (new["id"], "aborted")
    _, _, told = await service.call("GET", f"/api/v1/runs/{old['id']}/events?limit=500")
    assert [told["events"][-1]["kind"], told["events"][-1]["data"]["continued_by"]] == ["run.continued", new["id"]]
    await reaches(service, new["id"], "uploaded")
    first, rest = [await delivery_report(service, run_id) for run_id in (old["id"], new["id"])]
    assert (first["continues"], first["continued_by"]) == (None, new["id"])
    assert (rest["continues"], rest["continued_by"]) == (old["id"], None)
    assert first["entries"][-1]["data"] == {"continued_by": new["id"]}
    assert f"run {new['id']}, which flew the remaining items" in await sheet(service, old["id"])
    assert f"run {old['id']}: this flight flew the remaining items" in await sheet(service, new["id"])


async def test_a_run_that_is_not_over_or_has_nothing_left_is_not_continued(
    service: Service, plan: dict[str, Any]
) -> None:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    run = await create(service, made["id"])
    await reaches(service, run["id"], "uploaded")
    path = f"/api/v1/runs/{run['id']}/continuation"
    status, _, problem = await service.call("POST", path, json={})
    assert (status, problem["code"]) == (409, "run.not_over")
    await service.call("POST", f"/api/v1/runs/{run['id']}/abort")
    await reaches(service, run["id"], "aborted")
    stored = await service.services.runs.get(run["id"])
    over = stored.model_copy(update={"id": "run-over", "state": RunState.COMPLETED})
    await service.storage.events.append([], [over])
    status, _, problem = await service.call("POST", f"/api/v1/runs/{over.id}/continuation", json={})
    assert (status, problem["code"]) == (409, "run.no_remaining_items")


async def test_a_continuation_waits_for_the_ground_and_stays_within_the_plan(
    service: Service, plan: dict[str, Any]
) -> None:
    old = await ended(service, plan)
    path = f"/api/v1/runs/{old['id']}/continuation"
    service.links[0].change(landed=LandedState.IN_AIR)
    status, _, problem = await service.call("POST", path, json={})
    assert (status, problem["code"]) == (409, "state.conflict")
    service.links[0].change(landed=LandedState.ON_GROUND)
    status, _, problem = await service.call("POST", path, json={"continue_at": "nowhere"})
    assert (status, problem["findings"][0]["code"]) == (422, "change.continue_at_unknown")
    _, _, plans = await service.call("GET", "/api/v1/plans")
    assert len(plans["plans"]) == 1, "nothing is stored for what is refused"
    service.links[0].refusal = LinkTimeoutError("it does not tell its parameters")
    status, _, _ = await service.call("POST", path, json={})
    assert status == 504
    service.links[0].refusal = None
    _, _, plans = await service.call("GET", "/api/v1/plans")
    assert len(plans["plans"]) == 1, "nor for what the vehicle does not answer"
    status, _, new = await service.call("POST", path, json={"continue_at": "home"})
    assert (status, new["drops"]) == (202, [])


async def test_a_viewer_continues_nothing(service: Service, plan: dict[str, Any]) -> None:
    headers = await service.token(Role.VIEWER)
    status, _, problem = await service.call("POST", "/api/v1/runs/run-1/continuation", json={}, headers=headers)
    assert (status, problem["code"]) == (403, "role.insufficient")
