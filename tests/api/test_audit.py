"""Who did what, and what was refused: every kind of action, as a list and as CSV, for administrators."""

from __future__ import annotations

import asyncio
import csv
import io
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, get_args

import aiohttp
import pytest
from aiohttp import web

from app.api.application import ROUTES
from app.api.audit import audited
from app.api.observability import note_principal, request_log
from app.api.offboard.frames import AnyClientFrame
from app.api.problems import ApiError, answer_problems
from app.api.routing import Route
from app.services.access import Principal, Role
from tests.support.guarded import path_of
from tests.support.offboard_api import NORTH, PATH, link
from tests.support.offboard_socket import pilot
from tests.support.raw_socket import exchange
from tests.support.service_in_process import Service, run_service
from tests.support.socket_limits import HANDSHAKE

__all__ = ["link"]

AUDIT = "/api/v1/audit"
BOOTSTRAP = "bootstrap-token-of-a-test"
ADMIN = {"Authorization": f"Bearer {BOOTSTRAP}"}
ACTIONS = [route for route in ROUTES if route.is_action]
FRAMES = [frame.model_fields["type"].annotation.__args__[0] for frame in get_args(get_args(AnyClientFrame)[0])]
NOT_ACTIONS = {
    *("check_plan", "convert_plan", "check_job"),  # nothing changes
    *("send_setpoint", "renew_offboard_lease", "move_target", "report_target"),  # many a second
}
FRAME_FIELDS: dict[str, dict[str, Any]] = {
    "setpoint": {"setpoint": NORTH},
    "hand_over_lease": {"to": None},
    "task": {"task": {"type": "goto", "point": {"east_m": 1.0, "north_m": 1.0}, "duration_s": 5.0}},
    "queue": {"action": "clear"},
    "move": {"task_id": "task-1", "before": None},
    "change": {"task_id": "task-1", "change": {"duration_s": 9.0}},
    "remove": {"task_id": "task-1"},
    "target": {"task_id": "task-1", "point": {"east_m": 1.0, "north_m": 1.0}},
}


@pytest.fixture
async def guarded(tmp_path: Path) -> AsyncIterator[Service]:
    """A service for which a token exists."""
    async with run_service(tmp_path, bootstrap_token=BOOTSTRAP) as service:
        yield service


async def entries(
    service: Service, query: str = "limit=1000", headers: dict[str, str] | None = None
) -> list[dict[str, Any]]:
    """The audit, newest first."""
    status, _, page = await service.call("GET", f"{AUDIT}?{query}", headers=ADMIN if headers is None else headers)
    assert status == 200, page
    found: list[dict[str, Any]] = page["entries"]
    return found


async def told(
    service: Service, count: int, query: str = "limit=1000", headers: dict[str, str] | None = None
) -> list[dict[str, Any]]:
    """The audit once it has so many entries: refusals are written within a second."""
    async with asyncio.timeout(60):
        while len(found := await entries(service, query, headers)) < count:
            await asyncio.sleep(0.05)
    return found


def test_what_is_no_action_is_listed() -> None:
    assert {route.name for route in ROUTES if route.method != "GET" and not route.is_action} == NOT_ACTIONS


class Recorder:
    """The audit in a list."""

    def __init__(self) -> None:
        self.accepted: list[tuple[str, str, str]] = []
        self.refused: list[tuple[str, str, str, int, str]] = []

    async def accept(self, principal: Principal, action: str, target: str) -> None:
        self.accepted.append((principal.name, action, target))

    def refuse(
        self, principal: Principal | None, address: str, action: str, target: str, status: int, code: str
    ) -> None:
        self.refused.append(("" if principal is None else principal.name, action, target, status, code))


class NoMetrics:
    """Counts nothing."""

    def count_request(self, method: str, route: str, status: int, took_s: float) -> None: ...


async def asked(route: Route, recorder: Recorder, *, fails: bool) -> None:
    """The real row of the table with a handler that does nothing, behind the real middleware."""

    async def handler(request: web.Request) -> web.StreamResponse:
        note_principal(request, Principal("desk", Role.ADMIN, "token-1"))
        if fails:
            raise ApiError("run.wrong_state", "not now")
        return web.Response(status=204)

    middlewares = [request_log(NoMetrics()), audited(recorder, ROUTES), answer_problems]  # type: ignore[arg-type]
    app = web.Application(middlewares=middlewares)
    app.router.add_route(route.method, route.path, handler)
    runner = web.AppRunner(app)
    await runner.setup()
    try:
        site = web.TCPSite(runner, "127.0.0.1", 0)
        await site.start()
        url = f"http://127.0.0.1:{runner.addresses[0][1]}{path_of(route)}"
        async with aiohttp.ClientSession() as http, http.request(route.method, url):
            pass
    finally:
        await runner.cleanup()


@pytest.mark.parametrize("route", [route for route in ROUTES if route.method != "GET"], ids=lambda route: route.name)
async def test_each_action_is_recorded_whether_it_is_carried_out_or_refused(route: Route) -> None:
    recorder = Recorder()
    await asked(route, recorder, fails=False)
    await asked(route, recorder, fails=True)
    if route.name in NOT_ACTIONS:
        assert (recorder.accepted, recorder.refused) == ([], [])
    else:
        assert recorder.accepted == [("desk", route.name, path_of(route))]
        assert recorder.refused == [("desk", route.name, path_of(route), 409, "run.wrong_state")]


async def test_what_a_role_may_not_do_is_recorded_of_each_route(guarded: Service) -> None:
    viewer = await guarded.token(Role.VIEWER)
    for route in ROUTES:
        await guarded.call(route.method, path_of(route), headers=viewer)
    refusing = {route.name for route in ROUTES if route.role not in (None, Role.VIEWER)}
    found = await told(guarded, len(refusing), "limit=1000&outcome=refused")
    assert {(one["actor"], one["action"], one["status"], one["code"]) for one in found} == {
        ("a viewer", name, 403, "role.insufficient") for name in refusing
    }
    assert {one["address"] for one in found} == {"127.0.0.1"}


@pytest.mark.parametrize("frame", FRAMES)
async def test_each_frame_that_is_refused_is_recorded(service: Service, link: Any, frame: str) -> None:
    async with pilot(service) as ann:
        if frame == "acquire_lease":
            await ann.send("acquire_lease")  # a second time is one too many
        answer = await ann.send(frame, **FRAME_FIELDS.get(frame, {}))
        assert answer["type"] == "error", answer
    # a sentinel behind it: what was not recorded until then is not recorded
    await service.call("POST", "/api/v1/vehicles/v9/hold")
    found = [one for one in await told(service, 1, "outcome=refused&limit=1000", {}) if one["target"] == PATH]
    if frame in ("setpoint", "renew_lease", "target"):
        assert found == []
    else:
        name = "queue.clear" if frame == "queue" else frame
        assert [(one["actor"], one["action"], one["code"]) for one in found] == [("local", name, answer["code"])]


async def test_frames_that_are_carried_out_are_recorded(service: Service, link: Any) -> None:
    async with pilot(service) as ann:
        await ann.send("acquire_lease")
        await ann.send("setpoint", setpoint=NORTH)
        await ann.send("renew_lease")
        for kind, fields in (
            ("task", FRAME_FIELDS["task"]),
            ("queue", {"action": "clear"}),
            ("setpoint", {"setpoint": NORTH}),
            ("enter", {}),
            ("leave", {"to": "hold"}),
        ):
            answer = await ann.send(kind, **fields)
            assert answer["type"] != "error", answer
    found = await told(service, 5, "outcome=accepted&limit=1000", {})
    assert [one["action"] for one in reversed(found)] == ["acquire_lease", "task", "queue.clear", "enter", "leave"]
    assert {(one["actor"], one["target"]) for one in found} == {("local", PATH)}


async def test_a_delivery_is_told_with_the_names_of_those_who_asked_and_stays_in_the_chain(
    guarded: Service, plan: dict[str, Any]
) -> None:
    desk, fliers = await guarded.token(Role.DISPATCHER), await guarded.token(Role.PILOT)
    key = {"Idempotency-Key": "once"}
    for _ in range(2):  # a repetition is no action
        _, _, made = await guarded.call("POST", "/api/v1/plans", json=plan, headers=desk | key)
    await guarded.call("POST", "/api/v1/runs", json={"plan": made["id"], "vehicle": "v1"}, headers=desk)
    assert (await guarded.call("POST", "/api/v1/vehicles/v2/hold", headers=fliers))[0] == 202
    await guarded.call("GET", "/api/v1/runs", headers=desk)
    found = await told(guarded, 5, "limit=1000&outcome=accepted")
    done = [(one["actor"], one["action"]) for one in reversed(found) if one["seq"] is not None]
    assert done == [("a dispatcher", "create_plan"), ("a dispatcher", "create_run"), ("a pilot", "hold_vehicle")]
    events = {event.seq: event for event in await guarded.services.journal.read(0, 500)}
    assert all(events[one["seq"]].kind == "request.accepted" for one in found if one["seq"] is not None)
    tokens = {(one["actor"], one["action"], one["target"].split(" (")[0]) for one in found if one["seq"] is None}
    assert tokens == {("command line", "create_token", "a dispatcher"), ("command line", "create_token", "a pilot")}


async def test_strangers_are_recorded_by_their_address_and_counted(guarded: Service) -> None:
    wrong = {"Authorization": "Bearer wd_wrong"}
    for number in range(5):
        await guarded.call("POST", f"/api/v1/runs/run-{number}/start", headers=wrong)
    await guarded.call("GET", "/api/v1/runs", headers={"Host": "evil.example"})
    await guarded.call("POST", "/api/v1/plans", json={}, headers={"Origin": "https://evil.example"})
    await guarded.call("GET", "/api/v1/stream", headers=HANDSHAKE | wrong)
    async with asyncio.timeout(60):  # the strangers' refusals may be written in two lines
        while sum(one["count"] for one in await entries(guarded)) < 8:
            await asyncio.sleep(0.05)
    found = await entries(guarded)
    assert {one["code"] for one in found} == {"auth.invalid", "host.not_allowed", "origin.not_allowed"}
    assert sum(one["count"] for one in found if one["code"] == "auth.invalid") == 6
    assert {(one["actor"], one["address"]) for one in found} == {("", "127.0.0.1")}


async def test_what_is_no_request_is_not_recorded(guarded: Service) -> None:
    await exchange(guarded.port, b"nonsense\r\n\r\n")
    await guarded.call("GET", "/api/v1/runs/run-0", headers=ADMIN)
    assert await entries(guarded) == []


@pytest.mark.parametrize("role", [Role.VIEWER, Role.DISPATCHER, Role.PILOT])
async def test_only_administrators_read_it(guarded: Service, role: Role) -> None:
    status, _, problem = await guarded.call("GET", AUDIT, headers=await guarded.token(role))
    assert (status, problem["code"]) == (403, "role.insufficient")


async def test_pages_have_every_entry_once_whatever_happens_meanwhile(guarded: Service) -> None:
    pilot_token = await guarded.token(Role.PILOT)
    for _ in range(4):
        await guarded.call("POST", "/api/v1/vehicles/v1/hold", headers=pilot_token)
        await guarded.call("POST", "/api/v1/vehicles/v9/hold", headers=pilot_token)
        await asyncio.sleep(1.1)  # refusals that are alike are one entry if they come within a second
    whole = await told(guarded, 9)
    paged: list[dict[str, Any]] = []
    cursor: str | None = ""
    while cursor is not None:
        query = "limit=2" + (f"&cursor={cursor}" if cursor else "")
        _, _, page = await guarded.call("GET", f"{AUDIT}?{query}", headers=ADMIN)
        paged, cursor = paged + page["entries"], page["next"]
        await guarded.call("POST", "/api/v1/vehicles/v2/hold", headers=pilot_token)
    assert paged == whole
    times = [one["time"] for one in whole]
    assert times == sorted(times, reverse=True)


@pytest.mark.parametrize("cursor", ["x", "1", "1.2", "1.2.3.4", "-1..", "1.2.²", f"{10**19}.{10**19}.9"])
async def test_a_cursor_is_one_that_was_returned(guarded: Service, cursor: str) -> None:
    status, _, problem = await guarded.call("GET", AUDIT, params={"cursor": cursor}, headers=ADMIN)
    assert (status, problem["code"]) == (422, "input.invalid")


async def test_it_is_filtered_by_who_when_and_how_it_ended(guarded: Service) -> None:
    ann, ben = await guarded.token(Role.PILOT), await guarded.token(Role.PILOT)
    await guarded.call("POST", "/api/v1/vehicles/v1/hold", headers=ann)
    await guarded.call("POST", "/api/v1/vehicles/v9/hold", headers=ben)
    await told(guarded, 4)
    assert [one["action"] for one in await entries(guarded, "actor=a%20pilot%202")] == ["hold_vehicle"]
    assert [one["actor"] for one in await entries(guarded, "outcome=refused")] == ["a pilot 2"]
    assert await entries(guarded, "since=2100-01-01T00:00:00Z") == []
    assert len(await entries(guarded, "before=2100-01-01T00:00:00Z")) == 4


async def test_csv_has_the_same_entries_and_no_formulas(guarded: Service) -> None:
    _, secret = await guarded.access.create_token('=HYPERLINK("http://evil")', Role.PILOT)
    await guarded.call("POST", "/api/v1/vehicles/v1/hold", headers={"Authorization": f"Bearer {secret}"})
    status, headers, text = await guarded.call("GET", f"{AUDIT}?limit=1", headers=ADMIN | {"Accept": "text/csv"})
    assert (status, headers["Content-Type"]) == (200, "text/csv; charset=utf-8")
    assert "audit.csv" in headers["Content-Disposition"]
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [(row["actor"], row["action"]) for row in rows] == [('\'=HYPERLINK("http://evil")', "hold_vehicle")]
    assert 'rel="next"' in headers["Link"]


async def test_it_is_there_after_a_restart(tmp_path: Path) -> None:
    async with run_service(tmp_path, bootstrap_token=BOOTSTRAP) as service:
        await service.call("POST", "/api/v1/vehicles/v1/hold", headers=ADMIN)
        await service.call("POST", "/api/v1/vehicles/v9/hold", headers=ADMIN)
    async with run_service(tmp_path, bootstrap_token=BOOTSTRAP) as service:
        assert {one["outcome"] for one in await entries(service)} == {"accepted", "refused"}
