"""The task queue over REST and over the offboard websocket, and what watchers see of it."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.vehicle.state import FlightMode, LandedState
from app.services.access import Role
from tests.support.fake_links import FakeLink
from tests.support.offboard_socket import pilot
from tests.support.service_in_process import Service, until

PATH = "/api/v1/vehicles/v1/tasks"
OFFBOARD = "/api/v1/vehicles/v1/offboard"
GOTO: dict[str, Any] = {"type": "goto", "point": {"east_m": 10.0, "north_m": 20.0}}
CIRCLE: dict[str, Any] = {"type": "circle", "center": {"latitude_deg": 47.398, "longitude_deg": 8.546}, "radius_m": -20}


@pytest.fixture
def link(service: Service) -> FakeLink:
    """A vehicle in the air."""
    found = service.links[0]
    found.change(armed=True, landed=LandedState.IN_AIR, absolute_altitude_m=508.0, relative_altitude_m=20.0)
    return found


async def leased(service: Service) -> str:
    _, _, grant = await service.call("POST", f"{OFFBOARD}/lease", json={})
    return str(grant["lease"])


async def test_tasks_are_queued_and_flown_over_rest(service: Service, link: FakeLink) -> None:
    lease = await leased(service)
    status, headers, queued = await service.call("POST", PATH, json={"lease": lease, "task": GOTO})
    assert (status, queued["task_id"], headers["Location"]) == (201, "t1", PATH)
    first = {"lease": lease, "task": {**CIRCLE, "duration_s": 30.0}, "insert": "prepend", "when_empty": "wait"}
    _, _, queued = await service.call("POST", PATH, json=first)
    queue = queued["queue"]
    assert queue["origin"] == {"latitude_deg": 47.397742, "longitude_deg": 8.545594, "altitude_m": 488.0}
    assert (queue["report"]["task_list"], queue["report"]["state"], queue["when_empty"]) == ([2, 1], "waiting", "wait")
    assert [task["id"] for task in queue["tasks"]] == ["t2", "t1"]
    assert (await service.call("POST", f"{OFFBOARD}/enter", json={"lease": lease}))[0] == 200
    await until(lambda: len(link.setpoints) > 30)
    _, _, queue = await service.call("GET", PATH)
    assert (queue["report"]["state"], queue["report"]["current_id"]) == ("flying", "t2")
    assert 0.0 < queue["report"]["remaining_s"] <= 30.0
    assert queue["tasks"][0]["cross_m"] is not None
    for action, state in (("pause", "paused"), ("resume", "flying"), ("next", "flying"), ("clear", "standing")):
        status, _, queue = await service.call("POST", f"{PATH}/{action}", json={"lease": lease})
        assert (status, queue["report"]["state"]) == (200, state), action
    assert queue["report"]["task_list"] == [0]


async def test_the_order_is_changed_and_one_task_is_taken_out_over_rest(service: Service, link: FakeLink) -> None:
    lease = await leased(service)
    for task in (GOTO, CIRCLE, GOTO):
        await service.call("POST", PATH, json={"lease": lease, "task": task})
    status, _, queue = await service.call("POST", f"{PATH}/t3/move", json={"lease": lease, "before": "t1"})
    assert (status, queue["report"]["current_id"], ids(queue)) == (200, "t3", ["t3", "t1", "t2"])
    _, _, queue = await service.call("POST", f"{PATH}/t1/move", json={"lease": lease, "before": None})
    assert ids(queue) == ["t3", "t2", "t1"]
    status, _, queue = await service.call("DELETE", f"{PATH}/t3", json={"lease": lease})
    assert (status, queue["report"]["current_id"], ids(queue)) == (200, "t2", ["t2", "t1"])
    for asked in (
        service.call("POST", f"{PATH}/t9/move", json={"lease": lease, "before": None}),
        service.call("POST", f"{PATH}/t1/move", json={"lease": lease, "before": "t3"}),
        service.call("DELETE", f"{PATH}/t3", json={"lease": lease}),
    ):
        status, _, problem = await asked
        assert (status, problem["code"]) == (404, "resource.not_found")
    status, _, problem = await service.call("DELETE", f"{PATH}/t1", json={"lease": "another"})
    assert (status, problem["code"]) == (409, "offboard.lease_lost")
    assert problem["detail"] == "no such lease of vehicle v1, or it has ended"
    assert ids((await service.call("GET", PATH))[2]) == ["t2", "t1"], "what was refused changed nothing"


async def test_a_task_is_mended_over_rest_before_its_turn_and_refused_once_it_is_flown(
    service: Service, link: FakeLink
) -> None:
    lease = await leased(service)
    for task in (CIRCLE, GOTO):
        await service.call("POST", PATH, json={"lease": lease, "task": task})

    async def mend(task_id: str, **change: Any) -> tuple[int, Any]:
        status, _, body = await service.call("PATCH", f"{PATH}/{task_id}", json={"lease": lease, "change": change})
        return status, body

    status, queue = await mend("t2", duration_s=40, relative_altitude_m=25)
    entry = queue["tasks"][1]
    assert (status, entry["id"], entry["remaining_s"]) == (200, "t2", 40.0)
    assert (entry["task"]["duration_s"], entry["task"]["relative_altitude_m"]) == (40.0, 25.0)
    assert (await mend("t1", radius_m=-30))[1]["tasks"][0]["task"]["radius_m"] == -30.0, "nothing is flown yet"
    assert (await service.call("POST", f"{OFFBOARD}/enter", json={"lease": lease}))[0] == 200
    status, problem = await mend("t1", duration_s=60)
    assert (status, problem["code"]) == (409, "task.active")
    assert "replace_current" in problem["hint"]
    for task_id, change, wanted in (
        ("t2", {}, (422, "request.invalid")),
        ("t2", {"radius_m": None}, (422, "request.invalid")),
        ("t2", {"radius_m": 30}, (422, "task.refused")),
        ("t2", {"relative_altitude_m": 900}, (422, "task.refused")),
        ("t9", {"duration_s": 5}, (404, "resource.not_found")),
    ):
        status, problem = await mend(task_id, **change)
        assert (status, problem["code"]) == wanted
    assert (await service.call("GET", PATH))[2]["tasks"][1]["task"] == entry["task"], "what was refused changed nothing"


def ids(queue: Any) -> list[str]:
    return [task["id"] for task in queue["tasks"]]


async def test_a_key_makes_a_repeated_task_one_task(service: Service, link: FakeLink) -> None:
    body, headers = {"lease": await leased(service), "task": GOTO}, {"Idempotency-Key": "task-1"}
    answers = [await service.call("POST", PATH, json=body, headers=headers) for _ in range(2)]
    assert [answer[2]["task_id"] for answer in answers] == ["t1", "t1"]
    assert len((await service.call("GET", PATH))[2]["tasks"]) == 1


async def test_what_cannot_be_queued_is_said_with_its_code(service: Service, link: FakeLink) -> None:
    lease = await leased(service)
    far = {**GOTO, "point": {"east_m": 0.0, "north_m": 9000.0}}
    status, _, problem = await service.call("POST", PATH, json={"lease": lease, "task": far})
    assert (status, problem["code"], problem["refusal"]) == (422, "task.refused", "limit.distance")
    status, _, problem = await service.call("POST", PATH, json={"lease": lease, "task": {"type": "goto"}})
    assert (status, problem["code"]) == (422, "request.invalid")
    for _ in range(20):
        await service.call("POST", PATH, json={"lease": lease, "task": GOTO})
    status, _, problem = await service.call("POST", PATH, json={"lease": lease, "task": GOTO})
    assert (status, problem["code"], problem["capacity"]) == (409, "task.queue_full", 20)
    status, _, problem = await service.call("POST", PATH, json={"lease": "another", "task": GOTO})
    assert (status, problem["code"]) == (409, "offboard.lease_lost")
    status, _, problem = await service.call("POST", f"{PATH}/pause", json={"lease": "another"})
    assert (status, problem["code"]) == (409, "offboard.lease_lost")
    status, _, problem = await service.call("POST", f"{PATH}/t99/target", json={"lease": lease, "point": GOTO["point"]})
    assert (status, problem["code"]) == (404, "resource.not_found")


async def test_a_viewer_looks_and_a_pilot_flies(service: Service, link: FakeLink) -> None:
    viewer = await service.token(Role.VIEWER)
    assert (await service.call("GET", PATH, headers=viewer))[0] == 200
    status, _, problem = await service.call("POST", PATH, json={"lease": "x", "task": GOTO}, headers=viewer)
    assert (status, problem["code"]) == (403, "role.insufficient")
    assert (await service.call("GET", "/api/v1/vehicles/v9/tasks", headers=viewer))[0] == 404


async def test_the_same_over_the_websocket_with_reports_on_change_and_every_second(
    service: Service, link: FakeLink
) -> None:
    async with pilot(service) as ann:
        refused = await ann.send("task", task=GOTO)
        assert refused["code"] == "offboard.lease_lost"
        await ann.send("acquire_lease")
        queued = await ann.send("task", task={**GOTO, "motion": {"north_m_s": 1.0, "east_m_s": 0.0}})
        assert (queued["type"], queued["task_id"]) == ("queued", "t1")
        assert (await ann.send("enter"))["type"] == "done"
        assert (await tasks_frame(ann, "flying"))["report"]["task_list"] == [1]
        again = await tasks_frame(ann, "flying")
        assert again["tasks"][0]["remaining_m"] is not None, "it comes again without a change"
        for point in ({"east_m": 0.0, "north_m": 9000.0}, {"latitude_deg": 60.0, "longitude_deg": 8.5}):
            far = await ann.send("task", task={**GOTO, "point": point})
            assert (far["type"], far["code"]) == ("error", "limit.distance"), "and the flight goes on"
        target = await ann.send("target", task_id="t1", point=GOTO["point"], motion={"north_m_s": 0.0, "east_m_s": 1.0})
        assert target["type"] == "done"
        assert (await ann.send("queue", action="pause"))["type"] == "done"
        assert (await tasks_frame(ann, "paused"))["report"]["current_id"] == "t1"
        assert (await ann.send("task", task=CIRCLE))["task_id"] == "t2"
        assert (await ann.send("move", task_id="t2", before="t1"))["type"] == "done"
        assert (await tasks_frame(ann, "paused", "t2"))["report"]["task_list"] == [2, 1]
        assert (await ann.send("change", task_id="t1", change={"duration_s": 60.0}))["type"] == "done", (
            "not its turn yet"
        )
        assert (await ann.send("change", task_id="t2", change={"duration_s": 60.0}))["code"] == "task.active"
        assert (await ann.send("remove", task_id="t2"))["type"] == "done"
        assert (await tasks_frame(ann, "paused", "t1"))["report"]["task_list"] == [1]
        assert (await ann.send("remove", task_id="t2"))["code"] == "resource.not_found"
        assert (await ann.send("queue", action="clear"))["type"] == "done"
        assert (await tasks_frame(ann, "paused", None))["report"]["task_list"] == [0]


async def tasks_frame(ann: Any, state: str, current_id: str | None = "t1") -> Any:
    """The next report that says this."""
    while True:
        frame = await ann.frame()
        report = frame["queue"]["report"] if frame["type"] == "tasks" else {}
        if (report.get("state"), report.get("current_id")) == (state, current_id):
            return frame["queue"]


async def test_the_end_of_the_socket_is_the_end_of_the_queue_and_hold(service: Service, link: FakeLink) -> None:
    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        await ann.send("task", task=CIRCLE)
        await ann.send("enter")
        assert link.state().mode is FlightMode.OFFBOARD
    await until(lambda: link.state().mode is FlightMode.HOLD)
    assert (await service.call("GET", PATH))[2]["report"]["task_list"] == [0]


async def test_every_watcher_sees_the_report_with_the_telemetry(service: Service, link: FakeLink) -> None:
    lease = await leased(service)
    async with service.http.ws_connect(f"{service.url}/api/v1/stream") as stream:
        hello = await stream.receive_json(timeout=60)
        assert hello["type"] == "hello"
        snapshot = await stream.receive_json(timeout=60)
        assert snapshot["vehicles"][0]["state"]["offboard"]["tasks"] is None, "never used"
        await service.call("POST", PATH, json={"lease": lease, "task": GOTO})
        seen: dict[str, Any] = {}
        while {"event", "telemetry"} - set(seen):
            frame = await stream.receive_json(timeout=60)
            if frame["type"] == "event" and frame["event"]["kind"] == "task.changed":
                seen["event"] = frame["event"]["data"]
            tasks = (frame.get("vehicles") or {}) and (frame["vehicles"]["v1"]["offboard"] or {}).get("tasks")
            if tasks:
                seen["telemetry"] = tasks
    assert (seen["event"]["change"], seen["event"]["task_id"], seen["event"]["task_list"]) == ("inserted", "t1", [1])
    assert seen["event"]["task"]["point"] == GOTO["point"]
    assert (seen["telemetry"]["state"], seen["telemetry"]["task_list"]) == ("waiting", [1])
