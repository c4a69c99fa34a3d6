"""Moving delivery targets: reported over REST, followed by changes of the plan, and looked at before a release."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from app.domain.errors import LinkTimeoutError
from app.domain.plan import Plan
from app.domain.vehicle.state import FlightMode
from app.services.access import Role
from app.services.plans import NewPlan
from tests.support.asking_drop import until_run
from tests.support.run_changes import flying
from tests.support.service_in_process import Service
from tests.support.targets_api import CLINIC, EAST_DEG_M, clock, report, report_target, service

__all__ = ["clock", "service"]


@pytest.fixture
def plan(plan: dict[str, Any]) -> dict[str, Any]:
    """The clinic is a ship."""
    plan["items"][3] |= {"id": "drop", "target": {"feed": "ship-1", "max_move_m": 40, "max_speed_m_s": 2}}
    return plan


async def events_of(service: Service, run: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    _, _, page = await service.call("GET", f"/api/v1/runs/{run['id']}/events?limit=500")
    return [event["data"] for event in page["events"] if event["kind"] == kind]


async def first(service: Service, run: dict[str, Any], kind: str) -> dict[str, Any]:
    """The first event of this kind, once it is there. Before a report came the feed was silent."""
    async with asyncio.timeout(15):
        while True:
            for found in await events_of(service, run, kind):
                if "reason" not in found or code_of(found) != "target.feed_silent":
                    return found
            await asyncio.sleep(0.02)


def code_of(data: dict[str, Any]) -> str:
    """Of the error, where one of ours is the reason."""
    code: str = data["reason"]["params"].get("error", data["reason"]["code"])
    return code


async def arrive(service: Service, run_id: str) -> None:
    """At the clinic's hold; the vehicle's clock says 100 s."""
    place = {"longitude_deg": CLINIC[1], "boot_time_s": 100.0}
    service.links[0].change(mission_seq=2, latitude_deg=CLINIC[0] - 0.0001, **place)
    await until_run(service, run_id, lambda run: run["item_id"] == "clinic")
    service.links[0].change(latitude_deg=CLINIC[0], **place)
    await until_run(service, run_id, lambda run: run["drops"][0]["phase"] != "waiting")


async def ended(service: Service, run_id: str) -> dict[str, Any]:
    run = await until_run(service, run_id, lambda run: run["drops"][0]["phase"] == "done")
    return dict(run["drops"][0])


async def test_a_report_is_known_with_its_age_and_in_the_order_of_its_time(service: Service) -> None:
    status, _, problem = await service.call("GET", "/api/v1/targets/ship-1")
    assert (status, problem["code"]) == (404, "resource.not_found")
    first = report(age_s=2)
    for _ in range(2):
        status, known = await report_target(service, first)
        assert (status, known["report"], known["stale"]) == (200, first, False)
        assert known["age_s"] == 2
    _, _, known = await service.call("GET", "/api/v1/targets/ship-1")
    assert known["feed"] == "ship-1"
    status, problem = await report_target(service, report(age_s=60))
    assert (status, problem["code"]) == (409, "state.conflict")
    status, problem = await report_target(service, report(age_s=-600))
    assert (status, problem["code"]) == (422, "input.invalid")
    status, problem = await report_target(service, report(north_m_s=1000.0))
    assert (status, problem["code"]) == (422, "request.invalid")
    status, _, problem = await service.call("POST", "/api/v1/targets/a%20ship", json=report())
    assert (status, problem["code"]) == (422, "input.invalid")


async def test_a_dispatcher_reports_targets_and_a_viewer_reads_them(service: Service) -> None:
    assert (await report_target(service, report(), headers=await service.token(Role.DISPATCHER)))[0] == 200
    headers = await service.token(Role.VIEWER)
    assert (await report_target(service, report(), headers=headers))[0] == 403
    assert (await service.call("GET", "/api/v1/targets/ship-1", headers=headers))[0] == 200


async def test_the_waypoint_is_moved_to_where_the_target_will_be(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan, "clinic")
    await report_target(service, report(10))
    moved = await first(service, run, "run.target_moved")
    assert moved["from_planned_m"] == pytest.approx(10, abs=0.1)
    assert (moved["waypoint_id"], moved["target"]["feed"]) == ("clinic", "ship-1")
    _, _, changed = await service.call("GET", f"/api/v1/runs/{run['id']}")
    assert (changed["changes"], changed["plan_id"], changed["item_id"]) == (1, moved["plan_id"], "clinic")
    assert changed["change"]["actor"] == "target ship-1"
    assert changed["drops"][0]["planned_longitude_deg"] == pytest.approx(CLINIC[1] + 10 * EAST_DEG_M, abs=1e-6)
    _, _, made = await service.call("GET", f"/api/v1/plans/{moved['plan_id']}")
    assert made["plan"]["items"][3]["target"]["planned"] == {"latitude_deg": CLINIC[0], "longitude_deg": CLINIC[1]}


async def test_a_target_that_cannot_be_followed_is_recorded_and_moves_nothing(
    service: Service, plan: dict[str, Any]
) -> None:
    run = await flying(service, plan, "clinic")
    await report_target(service, report(41))
    refused = await first(service, run, "run.target_not_followed")
    assert code_of(refused) == "target.out_of_bounds"
    assert service.links[0].uploads == 0


LOCKER = {"id": "locker", "latitude_deg": 47.399181, "longitude_deg": 8.544797, "relative_altitude_m": 15}


async def test_a_move_from_which_the_way_to_the_alternate_is_forbidden_is_not_made(
    service: Service, plan: dict[str, Any]
) -> None:
    plan["items"][3]["alternate"] = LOCKER
    run = await flying(service, plan, "clinic")
    await report_target(service, report(latitude_deg=CLINIC[0] - 30 / 111_195))
    assert code_of(await first(service, run, "run.target_not_followed")) == "plan.rejected"
    assert service.links[0].uploads == 0


async def test_the_same_move_without_an_alternate_is_made(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan, "clinic")
    await report_target(service, report(latitude_deg=CLINIC[0] - 30 / 111_195))
    await first(service, run, "run.target_moved")


async def test_a_move_that_the_vehicle_does_not_take_is_recorded(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan, "clinic")
    service.links[0].upload_refusal = LinkTimeoutError("no answer")
    await report_target(service, report(10))
    refused = await first(service, run, "run.target_not_followed")
    assert (code_of(refused), refused["target"]["feed"]) == ("vehicle.timeout", "ship-1")


async def test_what_a_person_changed_meanwhile_is_not_undone(
    service: Service, plan: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = await flying(service, plan, "clinic")
    checked, was_checked = service.services.plans.checked, asyncio.Event()

    async def slowly(moved: Plan, actor: str) -> NewPlan:
        new = await checked(moved, actor)
        await service.call("POST", f"/api/v1/runs/{run['id']}/mission", json={"continue_at": "home"})
        was_checked.set()
        return new

    monkeypatch.setattr(service.services.plans, "checked", slowly)
    await report_target(service, report(10))
    async with asyncio.timeout(15):
        await was_checked.wait()
    _, _, changed = await service.call("GET", f"/api/v1/runs/{run['id']}")
    assert (changed["changes"], changed["item_id"], changed["plan_id"]) == (1, "home", run["plan_id"])
    assert await events_of(service, run, "run.target_moved") == []


async def test_the_parcel_is_released_at_the_target_with_its_place_and_age_as_evidence(
    service: Service, plan: dict[str, Any]
) -> None:
    run = await flying(service, plan)
    await report_target(service, report(1))
    await arrive(service, run["id"])
    await report_target(service, report(1))
    drop = await ended(service, run["id"])
    assert drop["outcome"] == "released"
    assert drop["target"]["distance_m"] == pytest.approx(1, abs=0.1)
    assert drop["target"]["age_s"] == 0
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run['id']}/delivery-report.html")
    assert "ship-1: " in sheet


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (None, "target_unknown"),
        ({"age_s": 6}, "target_stale"),
        ({"east_m": 45}, "target_away"),
        ({"east_m": 5000}, "target_away"),
        ({"north_m_s": 2.1}, "target_too_fast"),
    ],
)
async def test_without_the_target_the_parcel_is_kept_and_the_plan_says_what_then(
    service: Service, plan: dict[str, Any], body: dict[str, float] | None, code: str
) -> None:
    run = await flying(service, plan)
    if body is not None:
        await report_target(service, report(**body))
    await arrive(service, run["id"])
    service.links[0].change(boot_time_s=129.5)  # all but the last of the hold is over
    drop = await ended(service, run["id"])
    assert drop["outcome"] == "kept"
    assert drop["reason"]["code"] == f"drop.{code}"
    assert (drop["target"] is None) == (body is None)
    await until_run(service, run["id"], lambda run: run["state"] == "returning")
    assert service.links[0].state().mode is FlightMode.RETURN
