"""Jobs over REST: queued, given to a vehicle that can, flown one after the other, cancelled, expired, moved."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from app.domain.vehicle.state import LandedState
from app.services.access import Role
from app.services.jobs import JobSettings
from tests.support.job_plans import ROUTE, codes, fly_home, job_of, queue, start, until_job
from tests.support.jobs_api import stop
from tests.support.reasons import words
from tests.support.scheduled_jobs import IN_YEARS
from tests.support.service_in_process import Service, run_service

KEY = {"Idempotency-Key": "order-2041"}


async def resume(service: Service, vehicle_id: str | None = None) -> dict[str, Any]:
    """Let the queue of a vehicle go on."""
    status, _, view = await service.call("POST", f"/api/v1/job-queues/{vehicle_id or service.v1}/resume")
    assert status == 200
    return dict(view)


async def test_a_job_is_prepared_on_its_vehicle_and_waits_there_for_a_persons_start(service: Service) -> None:
    job = await queue(service, vehicle=service.v2)
    assert (job["plan_name"], job["order_id"], job["requested_by"]) == ("a round", "RX-7", "local")
    job = await until_job(service, job["id"], "prepared")
    assert (job["vehicle_id"], job["start_requested_at"]) == (service.v2, None)
    assert "operator" in words(job["reason"])
    assert service.links[1].state().armed is False
    await start(service, job)
    await until_job(service, job["id"], "flying")
    await fly_home(service, 2)
    job = await until_job(service, job["id"], "completed")
    assert job["ended_at"] >= job["created_at"]


async def test_jobs_of_one_vehicle_fly_one_after_the_other_without_a_person_if_they_say_so(service: Service) -> None:
    first, second = [await queue(service, vehicle=service.v1, auto_start=True) for _ in range(2)]
    await until_job(service, first["id"], "flying")
    assert codes(await job_of(service, second["id"]), service.v1)[0] == "vehicle.busy"
    await fly_home(service)
    await until_job(service, first["id"], "completed")
    await until_job(service, second["id"], "flying")
    await fly_home(service)
    await until_job(service, second["id"], "completed")
    _, _, runs = await service.call("GET", f"/api/v1/runs?vehicle={service.v1}")
    assert len(runs["runs"]) == 2


async def test_any_goes_to_the_nearest_that_can_with_a_reason_for_each_refusal(service: Service) -> None:
    near, far = service.links
    near.move(battery_percent=12.0)
    far.move(latitude_deg=47.3980)
    job = await until_job(service, (await queue(service))["id"], "prepared")
    assert job["vehicle_id"] == service.v2
    refused, chosen = job["candidates"]
    assert [(one["code"], one["pointer"]) for one in refused["refusals"]] == [("vehicle.battery_low", None)]
    assert (refused["chosen"], chosen["chosen"], chosen["refusals"]) == (False, True, [])
    assert words(chosen["reason"]) == "the only suitable vehicle"
    assert 25.0 < chosen["distance_m"] < 35.0


@pytest.mark.single
async def test_a_check_says_who_would_get_it_and_queues_nothing(service: Service) -> None:
    _, leased = service.links
    status, _, _ = await service.call("POST", f"/api/v1/vehicles/{service.v2}/offboard/lease", json={})
    assert status < 300
    leased.move(battery_percent=99.0)
    status, _, told = await service.call("POST", "/api/v1/job-checks", json={"plan": ROUTE, "vehicle": "any"})
    assert (status, told["vehicle_id"]) == (200, service.v1)
    assert codes(told, service.v2) == ["vehicle.leased"]
    narrowed = {"plan": ROUTE, "allowed_vehicles": [service.v2]}
    _, _, told = await service.call("POST", "/api/v1/job-checks", json=narrowed)
    assert (told["vehicle_id"], codes(told, service.v1), codes(told, service.v2)) == (
        None,
        ["vehicle.not_allowed"],
        ["vehicle.leased"],
    )
    wing = {"plan": {**ROUTE, "vehicle_type": "fixed_wing"}, "vehicle": service.v1}
    _, _, told = await service.call("POST", "/api/v1/job-checks", json=wing)
    assert "vehicle.type_differs" in codes(told, service.v1)
    _, _, listed = await service.call("GET", "/api/v1/jobs")
    assert listed == {"jobs": [], "next": None}


async def test_where_waydrop_chooses_a_vehicle_far_from_the_plans_home_is_refused(service: Service) -> None:
    away = {**ROUTE, "home": {"latitude_deg": 47.41, "longitude_deg": 8.545594, "absolute_altitude_m": 488.0}}
    _, _, told = await service.call("POST", "/api/v1/job-checks", json={"plan": away})
    assert [codes(told, vehicle) for vehicle in (service.v1, service.v2)] == [["vehicle.home_differs"]] * 2
    _, _, named = await service.call("POST", "/api/v1/job-checks", json={"plan": away, "vehicle": service.v1})
    assert named["vehicle_id"] == service.v1, "who names a vehicle has seen the warning"


async def test_a_run_that_ended_badly_stops_the_queue_until_an_operator_says_go_on(service: Service) -> None:
    link = service.links[0]
    first, second = [await queue(service, vehicle=service.v1, auto_start=True) for _ in range(2)]
    flying = await until_job(service, first["id"], "flying")
    await service.call("POST", f"/api/v1/runs/{flying['run_id']}/return")
    link.change(armed=False, landed=LandedState.ON_GROUND)
    failed = await until_job(service, first["id"], "failed")
    assert "ended as aborted" in words(failed["reason"])
    stopped = ["vehicle.queue_stopped"]  # the vehicle is let go a moment later
    await until_job(service, second["id"], "queued", and_so=lambda job: codes(job, service.v1) == stopped)
    _, _, queues = await service.call("GET", "/api/v1/job-queues")
    v1, v2 = queues["vehicles"]
    assert (v1["queue"]["stopped"], v1["queue"]["reason"], v1["ready"]) == (True, failed["reason"], False)
    assert (v1["waiting"], v2["ready"], queues["dispatching"]) == ([second["id"]], True, True)
    view = await resume(service)
    assert (view["queue"]["stopped"], view["queue"]["actor"]) == (False, "local")
    await until_job(service, second["id"], "flying")


async def test_a_run_that_no_job_made_stops_the_queue_too(service: Service, plan: dict[str, Any]) -> None:
    _, _, stored = await service.call("POST", "/api/v1/plans", json=plan)
    _, _, run = await service.call("POST", "/api/v1/runs", json={"plan": stored["id"], "vehicle": service.v1})
    job = await queue(service, vehicle=service.v1, auto_start=True)
    assert codes(job, service.v1) == ["vehicle.busy"]
    await service.call("POST", f"/api/v1/runs/{run['id']}/abort")
    await until_job(
        service, job["id"], "queued", and_so=lambda job: codes(job, service.v1) == ["vehicle.queue_stopped"]
    )
    assert service.links[0].state().armed is False


async def test_a_waiting_job_is_cancelled_at_once_and_a_prepared_one_is_taken_off_its_vehicle(service: Service) -> None:
    prepared = await queue(service, vehicle=service.v1)
    waiting = await queue(service, vehicle=service.v1)
    prepared = await until_job(service, prepared["id"], "prepared")
    for job in (waiting, prepared):
        assert (await service.call("POST", f"/api/v1/jobs/{job['id']}/cancel"))[0] == 202
    for job in (waiting, prepared):
        job = await until_job(service, job["id"], "cancelled")
        assert words(job["reason"]) == "cancelled by local"
    _, _, run = await service.call("GET", f"/api/v1/runs/{prepared['run_id']}")
    assert (run["state"], run["started_at"]) == ("aborted", None)
    after = await until_job(service, (await queue(service, vehicle=service.v1))["id"], "prepared")
    assert after["vehicle_id"] == service.v1, "to cancel a job stops no queue"


async def test_what_flies_or_is_over_is_not_cancelled_or_moved(service: Service) -> None:
    job = await until_job(service, (await queue(service, vehicle=service.v1, auto_start=True))["id"], "flying")
    for method, path in (("POST", f"/api/v1/jobs/{job['id']}/cancel"), ("PATCH", f"/api/v1/jobs/{job['id']}")):
        status, _, problem = await service.call(method, path, json={})
        assert (status, problem["code"], problem["state"]) == (409, "job.wrong_state", "flying")
    assert service.links[0].state().mode == "mission", "a refused cancelling moves nothing"
    await fly_home(service)
    await until_job(service, job["id"], "completed")
    status, _, problem = await service.call("POST", f"/api/v1/jobs/{job['id']}/cancel")
    assert (status, problem["code"]) == (409, "job.wrong_state")


async def test_a_job_is_not_begun_before_its_time_and_holds_up_nobody(service: Service) -> None:
    later = await queue(service, vehicle=service.v1, not_before=IN_YEARS, priority=9)
    now = await until_job(service, (await queue(service, vehicle=service.v1))["id"], "prepared")
    assert now["vehicle_id"] == service.v1
    assert (await job_of(service, later["id"]))["state"] == "queued"


async def test_a_job_cannot_be_moved_before_itself(service: Service) -> None:
    await stop(service)
    job = await queue(service, vehicle=service.v1)
    path = f"/api/v1/jobs/{job['id']}"
    status, _, problem = await service.call("PATCH", path, json={"before": job["id"]})
    assert (status, problem["code"]) == (422, "input.invalid")


async def test_priority_then_place_decide_the_order(service: Service) -> None:
    await stop(service)
    made = [await queue(service, vehicle=service.v1, priority=priority) for priority in (0, 0, 5)]
    first, second, urgent = (job["id"] for job in made)

    async def order() -> list[str]:
        _, _, queues = await service.call("GET", "/api/v1/job-queues")
        assert [job["id"] for job in queues["waiting"]] == queues["vehicles"][0]["waiting"]
        return list(queues["vehicles"][0]["waiting"])

    async def move(job_id: str, expect: int = 200, **to: Any) -> None:
        status, _, told = await service.call("PATCH", f"/api/v1/jobs/{job_id}", json=to)
        assert status == expect, told

    assert await order() == [urgent, first, second]
    await move(second, place="first")
    assert await order() == [urgent, second, first]
    await move(second, priority=5)
    assert await order() == [urgent, second, first], "it goes behind those that have the priority already"
    await move(second, priority=0, place="first")
    await move(first, priority=5, place="first")
    assert await order() == [first, urgent, second]
    await move(first, place="last")
    assert await order() == [urgent, first, second]
    await move(second, before=first)
    assert await order() == [urgent, second, first], "it takes the priority of the job it goes before"
    await move(second, before=urgent)
    assert await order() == [second, urgent, first]
    await move(second, before="job-x", expect=404)
    await move(second, before=first, priority=3, expect=422)
    assert await order() == [second, urgent, first]
    await move(urgent, place="first")
    await resume(service)
    await until_job(service, urgent, "prepared")


async def test_a_full_queue_refuses_and_stores_nothing(tmp_path: Path) -> None:
    async with run_service(tmp_path, jobs_settings=JobSettings(capacity=2)) as service:
        await stop(service)
        for _ in range(2):
            await queue(service, vehicle=service.v1)
        problem = await queue(service, vehicle=service.v1, expect=409)
        assert (problem["code"], problem["capacity"]) == ("job.queue_full", 2)
        _, _, listed = await service.call("GET", "/api/v1/jobs")
        assert len(listed["jobs"]) == 2


async def test_the_same_order_sent_twice_is_one_job(service: Service) -> None:
    await stop(service)
    answers = await asyncio.gather(*(queue(service, vehicle=service.v1, headers=KEY) for _ in range(5)))
    assert len({job["id"] for job in answers}) == 1
    _, _, listed = await service.call("GET", "/api/v1/jobs")
    assert len(listed["jobs"]) == 1


async def test_jobs_are_listed_by_filters_and_in_pages(service: Service) -> None:
    await stop(service, service.v1)
    await stop(service, service.v2)
    made = [(await queue(service, vehicle=service.vehicle_id(1 + number % 2)))["id"] for number in range(5)]
    await service.call("POST", f"/api/v1/jobs/{made[0]}/cancel")

    async def listed(query: str) -> list[int]:
        status, _, body = await service.call("GET", f"/api/v1/jobs?{query}")
        assert status == 200
        return [made.index(job["id"]) for job in body["jobs"]]

    assert await listed(f"vehicle={service.v1}") == [4, 2, 0]
    assert await listed(f"open=true&vehicle={service.v1}") == [4, 2]
    assert await listed("state=cancelled,expired") == [0]
    seen, query = [], "limit=2"
    while True:
        _, _, page = await service.call("GET", f"/api/v1/jobs?{query}")
        seen += [made.index(job["id"]) for job in page["jobs"]]
        if page["next"] is None:
            break
        query = f"limit=2&older_than={page['next']}"
    assert seen == [4, 3, 2, 1, 0]
    plan_id = (await job_of(service, made[1]))["plan_id"]
    assert await listed(f"plan={plan_id}") == [1]
    for query, status, code in (("state=x", 400, "request.query_invalid"), ("older_than=x", 404, "resource.not_found")):
        answered, _, problem = await service.call("GET", f"/api/v1/jobs?{query}")
        assert (answered, problem["code"]) == (status, code)


async def test_what_cannot_be_queued_is_refused(service: Service) -> None:
    cases: tuple[tuple[dict[str, Any], int, str], ...] = (
        ({"vehicle": "v9"}, 404, "resource.not_found"),
        ({"allowed_vehicles": [service.v1, "v9"]}, 404, "resource.not_found"),
        ({"plan": "plan-x"}, 404, "resource.not_found"),
        ({"plan": {"version": 1}}, 422, "plan.invalid"),
        ({"plan": {**ROUTE, "items": ROUTE["items"][1:]}}, 422, "plan.rejected"),
        ({"vehicle": service.v1, "allowed_vehicles": [service.v1]}, 422, "request.invalid"),
        ({"deadline": "1999-01-01T00:00:00Z"}, 422, "input.invalid"),
        (
            {"deadline": IN_YEARS, "not_before": IN_YEARS},
            422,
            "input.invalid",
        ),
        ({"deadline": "2999-01-01T00:00:00"}, 422, "request.invalid"),
        ({"autostart": True}, 422, "request.invalid"),
    )
    for case, status, code in cases:
        assert (await queue(service, expect=status, **case))["code"] == code, case
    _, _, listed = await service.call("GET", "/api/v1/jobs")
    assert listed["jobs"] == []


async def test_dispatchers_queue_and_stop_and_only_pilots_say_go_on(service: Service) -> None:
    viewer, dispatcher, pilot = [await service.token(role) for role in (Role.VIEWER, Role.DISPATCHER, Role.PILOT)]
    assert (await queue(service, expect=403, headers=viewer))["code"] == "role.insufficient"
    job = await queue(service, headers=dispatcher)
    assert job["requested_by"] == "a dispatcher"
    for headers, action, status in (
        (viewer, "stop", 403),
        (dispatcher, "stop", 200),
        (dispatcher, "resume", 403),
        (pilot, "resume", 200),
    ):
        assert (await service.call("POST", f"/api/v1/job-queues/{service.v1}/{action}", headers=headers))[0] == status


async def test_what_becomes_of_a_job_is_told_as_events_with_the_whole_job(service: Service) -> None:
    job = await until_job(service, (await queue(service, vehicle=service.v1, auto_start=True))["id"], "flying")
    await fly_home(service)
    await until_job(service, job["id"], "completed")
    _, _, page = await service.call("GET", "/api/v1/events?limit=500")
    told = [event for event in page["events"] if event["kind"] == "job.changed"]
    changes = ["queued", "assigned", "prepared", "start_asked", "started", "ended"]
    assert [event["data"]["change"] for event in told] == changes
    assert told[-1]["data"]["job"] == await job_of(service, job["id"])
    assert {event["vehicle_id"] for event in told[1:]} == {service.v1}


@pytest.mark.parametrize(
    "times",
    [
        {"deadline": "2020-01-01T00:00:00Z"},
        {"not_before": IN_YEARS, "deadline": IN_YEARS},
    ],
)
async def test_a_check_refuses_what_the_queue_refuses(service: Service, times: dict[str, str]) -> None:
    for path in ("/api/v1/job-checks", "/api/v1/jobs"):
        status, _, problem = await service.call("POST", path, json={"plan": ROUTE, "vehicle": "any"} | times)
        assert (status, problem["code"]) == (422, "input.invalid"), path
