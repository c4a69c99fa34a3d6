"""Runs over REST."""

from __future__ import annotations

from typing import Any

from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.reasons import words
from tests.support.runs_api import create, plan_id, reaches
from tests.support.service_in_process import Service

__all__ = ["plan_id"]


async def test_a_run_without_start_waits_uploaded_and_then_flies_when_told(service: Service, plan_id: str) -> None:
    run = await create(service, plan_id)
    assert (run["plan_id"], run["vehicle_id"], run["requested_by"]) == (plan_id, service.v1, "local")
    await reaches(service, run["id"], "uploaded")
    status, _, _ = await service.call("POST", f"/api/v1/runs/{run['id']}/start")
    assert status == 202
    await reaches(service, run["id"], "flying")


async def test_a_flying_run_is_paused_resumed_and_sent_home(service: Service, plan_id: str) -> None:
    run = await create(service, plan_id, start=True)
    await reaches(service, run["id"], "flying")
    for action, state in (("pause", "paused"), ("resume", "flying"), ("return", "returning")):
        status, _, _ = await service.call("POST", f"/api/v1/runs/{run['id']}/{action}")
        assert status == 202
        await reaches(service, run["id"], state)
    assert service.links[0].state().mode == "return"


async def test_a_flying_run_goes_to_a_rally_point_that_it_names_or_says_why_not(
    service: Service, plan: dict[str, Any]
) -> None:
    place = {"latitude_deg": 47.3985, "longitude_deg": 8.5460}
    plan["rally_points"] = [{**place, "relative_altitude_m": 20}]
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    run = await create(service, made["id"], start=True)
    path = f"/api/v1/runs/{run['id']}/divert"
    await reaches(service, run["id"], "flying")
    service.links[0].parameters |= {"RTL_TYPE": 2, "RTL_LAND_DELAY": 0.0}
    service.links[0].change(landed=LandedState.IN_AIR, **place)
    status, _, problem = await service.call("POST", path)
    assert (status, problem["code"], problem["refusal"]) == (409, "run.divert_refused", "divert.return_type")
    service.links[0].parameters["RTL_TYPE"] = 5
    status, _, told = await service.call("POST", path)
    assert (status, told["rally"]["index"], told["rally"]["latitude_deg"]) == (202, 0, 47.3985)
    assert "the nearest rally point (RTL_TYPE 5)" in words(told["rally"]["reason"])
    await reaches(service, run["id"], "returning")


async def test_a_flying_run_is_landed_or_aborted_by_the_vehicle_in_its_mode(service: Service, plan_id: str) -> None:
    for vehicle, link, action, mode in (
        (service.v1, service.links[0], "land", "land"),
        (service.v2, service.links[1], "abort", "return"),
    ):
        run = await create(service, plan_id, vehicle, start=True)
        await reaches(service, run["id"], "flying")
        status, _, _ = await service.call("POST", f"/api/v1/runs/{run['id']}/{action}")
        assert (status, link.state().mode) == (202, mode)


async def test_a_second_run_of_a_vehicle_is_409(service: Service, plan_id: str) -> None:
    first = await create(service, plan_id)
    status, _, problem = await service.call("POST", "/api/v1/runs", json={"plan": plan_id, "vehicle": service.v1})
    assert (status, problem["code"], problem["run_id"]) == (409, "vehicle.busy", first["id"])


async def test_a_vehicle_that_somebody_else_has_armed_takes_no_run_and_starts_none(
    service: Service, plan_id: str
) -> None:
    run = await create(service, plan_id)
    await reaches(service, run["id"], "uploaded")
    for link in service.links:
        link.change(armed=True, mode=FlightMode.POSITION)
    body = {"plan": plan_id, "vehicle": service.v2, "start": True}
    for path, asked in (("/api/v1/runs", body), (f"/api/v1/runs/{run['id']}/start", {})):
        status, _, problem = await service.call("POST", path, json=asked)
        assert (status, problem["code"], problem["mode"]) == (409, "vehicle.taken", "position")
        assert "armed in POSITION mode" in problem["detail"]
        assert "disarm" in problem["hint"]
    await reaches(service, run["id"], "uploaded")


async def test_a_vehicle_whose_link_is_lost_takes_no_run(service: Service, plan_id: str) -> None:
    service.links[0].change(connected=False)
    status, _, problem = await service.call("POST", "/api/v1/runs", json={"plan": plan_id, "vehicle": service.v1})
    assert (status, problem["code"], problem["hint"]) == (409, "state.conflict", "wait until it is connected")


async def test_an_unknown_plan_vehicle_or_run_is_404(service: Service, plan_id: str) -> None:
    for body in ({"plan": "no", "vehicle": service.v1}, {"plan": plan_id, "vehicle": "v9"}):
        status, _, problem = await service.call("POST", "/api/v1/runs", json=body)
        assert (status, problem["code"]) == (404, "resource.not_found")
    for method, path in (("GET", ""), ("GET", "/events"), ("POST", "/start"), ("POST", "/abort")):
        status, _, problem = await service.call(method, f"/api/v1/runs/no{path}")
        assert (status, problem["code"]) == (404, "resource.not_found")


async def test_what_a_state_does_not_allow_is_409(service: Service, plan_id: str) -> None:
    run = await create(service, plan_id)
    await reaches(service, run["id"], "uploaded")
    for action in ("pause", "resume", "return", "land"):
        status, _, problem = await service.call("POST", f"/api/v1/runs/{run['id']}/{action}")
        assert (status, problem["code"], problem["state"]) == (409, "run.wrong_state", "uploaded")
    status, _, _ = await service.call("POST", f"/api/v1/runs/{run['id']}/abort")
    assert status == 202
    await reaches(service, run["id"], "aborted")


async def test_runs_are_listed_newest_first_by_vehicle_and_by_being_open(service: Service, plan_id: str) -> None:
    first = await create(service, plan_id, service.v1)
    await service.call("POST", f"/api/v1/runs/{first['id']}/abort")
    await reaches(service, first["id"], "aborted")
    second = await create(service, plan_id, service.v2)

    async def listed(query: str) -> list[str]:
        _, _, body = await service.call("GET", f"/api/v1/runs{query}")
        return [run["id"] for run in body["runs"]]

    assert await listed("") == [second["id"], first["id"]]
    assert await listed("?limit=1") == [second["id"]]
    assert await listed(f"?vehicle={service.v1}") == [first["id"]]
    assert await listed("?open=true") == [second["id"]]
    assert await listed(f"?open=true&vehicle={service.v1}") == []
    assert await listed(f"?open=false&vehicle={service.v2}") == [second["id"]]


async def test_a_runs_events_are_its_own_and_come_in_pages(service: Service, plan_id: str) -> None:
    run, other = await create(service, plan_id, service.v1), await create(service, plan_id, service.v2)
    await reaches(service, run["id"], "uploaded")
    await reaches(service, other["id"], "uploaded")
    seen: list[dict[str, Any]] = []
    while True:
        after = seen[-1]["position"] if seen else 0
        _, _, page = await service.call("GET", f"/api/v1/runs/{run['id']}/events?after={after}&limit=2")
        if not page["events"]:
            break
        assert len(page["events"]) <= 2
        seen += page["events"]
    assert {event["run_id"] for event in seen} == {run["id"]}
    assert seen[0]["kind"] == "run.created"
    positions = [event["position"] for event in seen]
    assert positions == sorted(set(positions))


async def test_a_body_that_does_not_fit_is_refused_with_pointers(service: Service) -> None:
    for body, pointer in (
        ({"vehicle": service.v1}, "/plan"),
        ({"plan": "p", "vehicle": 1}, "/vehicle"),
        ({"plan": "p", "vehicle": service.v1, "start": "yes"}, "/start"),
        ({"plan": "p", "vehicle": service.v1, "go": True}, "/go"),
        ([], ""),
    ):
        status, _, problem = await service.call("POST", "/api/v1/runs", json=body)
        assert (status, problem["code"]) == (422, "request.invalid")
        assert [finding["pointer"] for finding in problem["findings"]] == [pointer]


async def test_a_comparison_has_every_item_with_its_prediction_and_why_it_was_not_flown(
    service: Service, plan: dict[str, Any]
) -> None:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    run = await create(service, made["id"])
    status, _, comparison = await service.call("GET", f"/api/v1/runs/{run['id']}/comparison")
    assert status == 200
    assert [item["item_id"] for item in comparison["items"]] == made["timeline"]["order"]
    assert all(item["predicted_s"] >= 0.0 and item["flown_s"] is None for item in comparison["items"])
    assert {item["reason"]["code"] for item in comparison["items"]} == {"comparison.not_flown_yet"}
    assert (await service.call("GET", "/api/v1/runs/run-nobody/comparison"))[0] == 404
