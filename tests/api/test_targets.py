"""Moving delivery targets: reported over REST, followed by changes of the plan, and looked at before a release."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.errors import LinkTimeoutError
from app.domain.geo import distance_m
from app.domain.plan import Plan
from app.domain.plan.intercept import SETTLE_S
from app.domain.vehicle.clock import VehicleClock
from app.domain.vehicle.state import FlightMode
from app.services.access import Role
from app.services.plans import NewPlan
from app.services.target_following import TargetFollower
from tests.support.asking_drop import until_run
from tests.support.fake_links import HOME
from tests.support.run_changes import flying
from tests.support.service_in_process import Service
from tests.support.targets_api import CLINIC, EAST_DEG_M, StillClock, clock, report, say, service

__all__ = ["clock", "service"]


@pytest.fixture
def plan(plan: dict[str, Any]) -> dict[str, Any]:
    """The clinic is a ship."""
    plan["items"][3] |= {"id": "drop", "target": {"feed": "ship-1", "max_move_m": 40, "max_speed_m_s": 2}}
    return plan


@pytest.fixture
def follower(service: Service, clock: StillClock) -> TargetFollower:
    parts = service.services
    return TargetFollower(parts.runs, parts.plans, parts.fleet, parts.targets, parts.journal, clock)


async def told(service: Service, run: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    _, _, page = await service.call("GET", f"/api/v1/runs/{run['id']}/events?limit=500")
    return [event["data"] for event in page["events"] if event["kind"] == kind]


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
        status, known = await say(service, first)
        assert (status, known["report"], known["stale"]) == (200, first, False)
        assert known["age_s"] == 2
    _, _, known = await service.call("GET", "/api/v1/targets/ship-1")
    assert known["feed"] == "ship-1"
    status, problem = await say(service, report(age_s=60))
    assert (status, problem["code"]) == (409, "state.conflict")
    status, problem = await say(service, report(age_s=-600))
    assert (status, problem["code"]) == (422, "input.invalid")
    status, problem = await say(service, report(north_m_s=1000.0))
    assert (status, problem["code"]) == (422, "request.invalid")
    status, _, problem = await service.call("POST", "/api/v1/targets/a%20ship", json=report())
    assert (status, problem["code"]) == (422, "input.invalid")


async def test_a_dispatcher_reports_targets_and_a_viewer_reads_them(service: Service) -> None:
    assert (await say(service, report(), headers=await service.token(Role.DISPATCHER)))[0] == 200
    headers = await service.token(Role.VIEWER)
    assert (await say(service, report(), headers=headers))[0] == 403
    assert (await service.call("GET", "/api/v1/targets/ship-1", headers=headers))[0] == 200


async def test_the_waypoint_is_moved_to_where_the_target_will_be(
    service: Service, plan: dict[str, Any], follower: TargetFollower
) -> None:
    run = await flying(service, plan, "clinic")
    await say(service, report(10))
    await follower.look()
    [moved] = await told(service, run, "run.target_moved")
    assert moved["from_planned_m"] == pytest.approx(10, abs=0.1)
    assert (moved["waypoint_id"], moved["target"]["feed"]) == ("clinic", "ship-1")
    _, _, changed = await service.call("GET", f"/api/v1/runs/{run['id']}")
    assert (changed["changes"], changed["plan_id"], changed["item_id"]) == (1, moved["plan_id"], "clinic")
    assert changed["change"]["actor"] == "target ship-1"
    assert changed["drops"][0]["planned_longitude_deg"] == pytest.approx(CLINIC[1] + 10 * EAST_DEG_M, abs=1e-6)
    _, _, made = await service.call("GET", f"/api/v1/plans/{moved['plan_id']}")
    assert made["plan"]["items"][3]["target"]["planned"] == {"latitude_deg": CLINIC[0], "longitude_deg": CLINIC[1]}
    await say(service, report(20))
    await follower.look()
    assert len(await told(service, run, "run.target_moved")) == 1, "not again within seconds"


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (None, "target.feed_silent"),
        ({"age_s": 60}, "target.stale"),
        ({"east_m": 41}, "target.out_of_bounds"),
        ({"north_m_s": 3}, "target.too_fast"),
    ],
)
async def test_a_target_that_cannot_be_followed_is_told_once_and_moves_nothing(
    service: Service, plan: dict[str, Any], follower: TargetFollower, body: dict[str, float] | None, code: str
) -> None:
    run = await flying(service, plan, "clinic")
    if body is not None:
        await say(service, report(**body))
    for _ in range(3):
        await follower.look()
    assert [code_of(data) for data in await told(service, run, "run.target_not_followed")] == [code]
    assert service.links[0].uploads == 0


async def test_a_target_that_is_lost_or_jumps_away_is_followed_again_when_it_is_back(
    service: Service, plan: dict[str, Any], follower: TargetFollower, clock: StillClock
) -> None:
    run = await flying(service, plan, "clinic")
    await say(service, report(10))
    await follower.look()
    for passed_s, east_m in ((6.0, None), (12.0, 41), (13.0, 1000), (14.0, 15)):
        clock.passed_s = passed_s
        if east_m is not None:  # else the feed is silent
            await say(service, report(east_m, age_s=-passed_s))
        await follower.look()
    codes = [code_of(data) for data in await told(service, run, "run.target_not_followed")]
    assert codes == ["target.stale", "target.out_of_bounds"], "each once"
    moved = [data["from_planned_m"] for data in await told(service, run, "run.target_moved")]
    assert moved == [pytest.approx(10, abs=0.1), pytest.approx(15, abs=0.1)], "from where it was planned first"
    assert service.links[0].uploads == 2


@pytest.mark.parametrize("rate", [1.0, 4.0])
async def test_the_target_is_met_in_our_time_however_fast_the_vehicles_clock_runs(
    service: Service, plan: dict[str, Any], follower: TargetFollower, rate: float
) -> None:
    plan["items"][2]["speed_m_s"] = 6
    run = await flying(service, plan, "clinic")
    service.links[0].change(clock=VehicleClock(((0.0, 0.0), (2.0, 2.0 * rate), (4.0, 4.0 * rate))))
    await say(service, report(10))
    await follower.look()
    [moved] = await told(service, run, "run.target_moved")
    way_m = distance_m(HOME.latitude_deg, HOME.longitude_deg, *moved["moved_to"].values())
    assert moved["after_s"] == pytest.approx(SETTLE_S + way_m / 6 / rate, abs=0.05)


LOCKER = {"id": "locker", "latitude_deg": 47.399181, "longitude_deg": 8.544797, "relative_altitude_m": 15}


@pytest.mark.parametrize(("alternate", "codes"), [(None, []), (LOCKER, ["plan.rejected"])])
async def test_a_move_from_which_the_way_to_the_alternate_is_forbidden_is_not_made(
    service: Service, plan: dict[str, Any], follower: TargetFollower, alternate: dict[str, Any] | None, codes: list[str]
) -> None:
    plan["items"][3]["alternate"] = alternate
    run = await flying(service, plan, "clinic")
    south = CLINIC[0] - 30 / 111_195
    await say(service, report(latitude_deg=south))
    await follower.look()
    assert [code_of(data) for data in await told(service, run, "run.target_not_followed")] == codes
    assert service.links[0].uploads == (0 if codes else 1)


async def test_a_small_move_another_item_and_a_pause_move_nothing(
    service: Service, plan: dict[str, Any], follower: TargetFollower
) -> None:
    run = await flying(service, plan)
    await say(service, report(10))
    await follower.look()
    service.links[0].change(mission_seq=2)
    await until_run(service, run["id"], lambda run: run["item_id"] == "clinic")
    await say(service, report(0.9))
    await follower.look()
    await service.call("POST", f"/api/v1/runs/{run['id']}/pause")
    await until_run(service, run["id"], lambda run: run["state"] == "paused")
    await say(service, report(10))
    await follower.look()
    assert service.links[0].uploads == 0
    assert await told(service, run, "run.target_not_followed") == []


async def test_a_move_that_the_vehicle_does_not_take_is_told(
    service: Service, plan: dict[str, Any], follower: TargetFollower
) -> None:
    run = await flying(service, plan, "clinic")
    service.links[0].upload_refusal = LinkTimeoutError("no answer")
    await say(service, report(10))
    await follower.look()
    [refused] = await told(service, run, "run.target_not_followed")
    assert (code_of(refused), refused["target"]["feed"]) == ("vehicle.timeout", "ship-1")


async def test_what_a_person_changed_meanwhile_is_not_undone(
    service: Service, plan: dict[str, Any], follower: TargetFollower, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = await flying(service, plan, "clinic")
    checked = service.services.plans.checked

    async def slowly(moved: Plan, actor: str) -> NewPlan:
        new = await checked(moved, actor)
        await service.call("POST", f"/api/v1/runs/{run['id']}/mission", json={"continue_at": "home"})
        return new

    monkeypatch.setattr(service.services.plans, "checked", slowly)
    await say(service, report(10))
    await follower.look()
    _, _, changed = await service.call("GET", f"/api/v1/runs/{run['id']}")
    assert (changed["changes"], changed["item_id"], changed["plan_id"]) == (1, "home", run["plan_id"])
    assert await told(service, run, "run.target_moved") == []


async def test_the_parcel_is_released_at_the_target_with_its_place_and_age_as_evidence(
    service: Service, plan: dict[str, Any]
) -> None:
    run = await flying(service, plan)
    await say(service, report(20))
    await arrive(service, run["id"])
    await say(service, report(1))
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
        ({"east_m": 5}, "target_away"),
        ({"east_m": 5000}, "target_away"),
        ({"north_m_s": 2.1}, "target_too_fast"),
    ],
)
async def test_without_the_target_the_parcel_is_kept_and_the_plan_says_what_then(
    service: Service, plan: dict[str, Any], body: dict[str, float] | None, code: str
) -> None:
    run = await flying(service, plan)
    if body is not None:
        await say(service, report(**body))
    await arrive(service, run["id"])
    service.links[0].change(boot_time_s=129.5)  # all but the last of the hold is over
    drop = await ended(service, run["id"])
    assert drop["outcome"] == "kept"
    assert drop["reason"]["code"] == f"drop.{code}"
    assert (drop["target"] is None) == (body is None)
    await until_run(service, run["id"], lambda run: run["state"] == "returning")
    assert service.links[0].state().mode is FlightMode.RETURN
