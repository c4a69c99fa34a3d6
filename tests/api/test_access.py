"""Who may do what: each route with each role, and with none."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from app.api.application import ROUTES
from app.services.access import Role
from app.services.attempts import MOST_FAILURES
from tests.support.events import data_of
from tests.support.fakes import ManualClock
from tests.support.guarded import path_of
from tests.support.listener import listen
from tests.support.service_in_process import SETTINGS, Service, run_service
from tests.support.socket_limits import HANDSHAKE

BOOTSTRAP = "bootstrap-token-of-a-test"


@pytest.fixture
async def guarded(tmp_path: Path) -> AsyncIterator[Service]:
    """A service for which a token exists."""
    async with run_service(tmp_path, bootstrap_token=BOOTSTRAP) as service:
        yield service


@pytest.mark.parametrize("role", Role)
async def test_each_route_with_each_role(guarded: Service, role: Role) -> None:
    headers = await guarded.token(role)
    for route in ROUTES:
        status, _, body = await guarded.call(route.method, path_of(route), headers=headers)
        if route.role is None or role.allows(route.role):
            assert status not in (401, 403), route.path
        else:
            assert (status, body["code"]) == (403, "role.insufficient"), route.path
            assert route.role.value in body["detail"]


async def test_without_a_token_only_public_routes_answer(guarded: Service) -> None:
    public = set()
    for route in ROUTES:
        status, headers, body = await guarded.call(route.method, path_of(route))
        if status == 401:
            assert body["code"] == "auth.required"
            assert headers["WWW-Authenticate"].startswith("Bearer")
        else:
            public.add(route.path)
    assert public == {
        "/healthz",
        "/readyz",
        "/api/v1/openapi.json",
        "/api/v1/asyncapi.json",
        "/api/v1/problems",
        "/api/v1/schemas/plan",
    }


async def test_who_moves_a_vehicle_is_at_least_a_pilot() -> None:
    moving = {route.path for route in ROUTES if route.role is Role.PILOT}
    for action in ("hold", "return", "land"):
        assert f"/api/v1/vehicles/{{vehicle_id}}/{action}" in moving
    for action in ("pause", "resume", "return", "land", "abort"):
        assert f"/api/v1/runs/{{run_id}}/{action}" in moving


@pytest.mark.parametrize(
    "authorization",
    ["Bearer wrong", "Bearer", "Bearer ", "Basic YTpi", "wd_x", "Bearer \xff\xfe", "Bearer " + "x" * 5000],
)
async def test_a_token_that_is_none_is_401_on_loopback_too(service: Service, authorization: str) -> None:
    status, headers, problem = await service.call("GET", "/api/v1/vehicles", headers={"Authorization": authorization})
    assert (status, problem["code"]) == (401, "auth.invalid")
    assert "WWW-Authenticate" in headers


async def test_a_revoked_token_opens_nothing(guarded: Service) -> None:
    token, secret = await guarded.access.create_token("lost", Role.ADMIN)
    headers = {"Authorization": f"Bearer {secret}"}
    assert (await guarded.call("GET", "/api/v1/vehicles", headers=headers))[0] == 200
    await guarded.access.revoke(token.id)
    assert (await guarded.call("GET", "/api/v1/vehicles", headers=headers))[0] == 401


async def test_a_socket_whose_token_is_revoked_is_closed_with_4401(tmp_path: Path) -> None:
    settings = replace(SETTINGS, access_again_s=0.05)
    async with run_service(tmp_path, settings=settings) as service:
        token, secret = await service.access.create_token("lost", Role.VIEWER)
        async with listen(service, headers={"Authorization": f"Bearer {secret}"}) as listener:
            await listener.frame("snapshot")
            await service.access.revoke(token.id)
            assert await listener.close_code() == 4401


async def test_a_name_that_is_not_this_machines_needs_a_token_though_it_comes_from_here(tmp_path: Path) -> None:
    settings = replace(SETTINGS, allowed_hosts=("waydrop.example",))
    async with run_service(tmp_path, settings=settings) as service:
        status, _, problem = await service.call("GET", "/api/v1/vehicles", headers={"Host": "waydrop.example"})
        assert (status, problem["code"]) == (401, "auth.required")


async def test_loopback_needs_no_token_until_one_exists(service: Service) -> None:
    assert (await service.call("GET", "/api/v1/vehicles"))[0] == 200
    await service.access.create_token("first", Role.VIEWER)
    assert (await service.call("GET", "/api/v1/vehicles"))[0] == 401


@pytest.mark.parametrize(
    "header",
    [
        *(
            "X-Forwarded-For",
            "X-Forwarded-Proto",
            "X-Forwarded-Host",
            "x-forwarded-port",
            "Forwarded",
            "X-Real-IP",
            "Via",
        ),
        *("X-Client-IP", "True-Client-IP", "CF-Connecting-IP"),
    ],
)
async def test_what_a_proxy_on_this_machine_passes_on_is_not_this_machine(service: Service, header: str) -> None:
    status, _, problem = await service.call("GET", "/api/v1/vehicles", headers={header: "203.0.113.7"})
    assert (status, problem["code"]) == (401, "auth.required")
    assert "proxy" in problem["detail"]
    status, _, problem = await service.call("GET", "/api/v1/stream", headers=HANDSHAKE | {header: "127.0.0.1"})
    assert (status, problem) == (101, ""), "told by the close code"


async def test_a_token_that_has_expired_opens_nothing_and_ends_its_socket(tmp_path: Path) -> None:
    settings, clock = replace(SETTINGS, access_again_s=0.05), ManualClock()
    async with run_service(tmp_path, settings=settings, access_clock=clock) as service:
        _, secret = await service.access.create_token("brief", Role.VIEWER, lifetime_s=60.0)
        headers = {"Authorization": f"Bearer {secret}"}
        async with listen(service, headers=headers) as listener:
            await listener.frame("snapshot")
            clock.time_s += 60.0
            assert await listener.close_code() == 4401
        status, _, problem = await service.call("GET", "/api/v1/vehicles", headers=headers)
        assert (status, problem["code"]) == (401, "auth.invalid")


async def test_an_address_that_guesses_tokens_is_told_to_wait(guarded: Service) -> None:
    pilot = await guarded.token(Role.PILOT)
    assert (await guarded.call("GET", "/api/v1/vehicles", headers=pilot))[0] == 200
    for number in range(MOST_FAILURES):
        headers = {"Authorization": f"Bearer wd_guess-{number}"}
        assert (await guarded.call("GET", "/api/v1/vehicles", headers=headers))[0] == 401
    status, headers, problem = await guarded.call(
        "GET", "/api/v1/vehicles", headers={"Authorization": f"Bearer {BOOTSTRAP}"}
    )
    assert (status, problem["code"]) == (429, "auth.too_many_attempts")
    assert 0 < int(headers["Retry-After"]) <= 60
    assert (await guarded.call("GET", "/api/v1/vehicles", headers=pilot))[0] == 200, "who was in goes on"
    async with guarded.http.ws_connect(
        f"{guarded.url}/api/v1/stream", protocols=("waydrop.v1", "bearer.wrong")
    ) as socket:
        await socket.receive(timeout=60)
        assert socket.close_code == 1013


async def test_who_did_it_is_the_tokens_name(guarded: Service) -> None:
    guarded.links[0].change(armed=True)
    await guarded.call("POST", "/api/v1/vehicles/v1/hold", headers=await guarded.token(Role.PILOT))
    events = await guarded.services.journal.read(0, 100)
    assert [data_of(event)["actor"] for event in events if event.kind == "vehicle.command"] == ["a pilot", "a pilot"]


async def test_a_socket_takes_the_token_as_header_or_as_subprotocol(guarded: Service) -> None:
    headers = await guarded.token(Role.VIEWER)
    secret = headers["Authorization"].removeprefix("Bearer ")
    url = f"{guarded.url}/api/v1/stream"
    async with guarded.http.ws_connect(url, headers=headers) as socket:
        assert (await socket.receive_json())["type"] == "hello"
    async with guarded.http.ws_connect(url, protocols=("waydrop.v1", f"bearer.{secret}")) as socket:
        assert socket.protocol == "waydrop.v1"
        assert (await socket.receive_json())["type"] == "hello"


async def test_a_socket_without_a_good_token_is_closed_with_4401(guarded: Service) -> None:
    url = f"{guarded.url}/api/v1/stream"
    for protocols in ((), ("waydrop.v1",), ("waydrop.v1", "bearer.wrong"), ("waydrop.v1", "bearer.")):
        async with guarded.http.ws_connect(url, protocols=protocols) as socket:
            message = await socket.receive(timeout=60)
            assert (message.data, socket.close_code) == (4401, 4401), protocols


async def test_a_token_never_shows_up_in_the_log(guarded: Service, capfd: pytest.CaptureFixture[str]) -> None:
    _, secret = await guarded.access.create_token("quiet", Role.VIEWER)
    url = f"{guarded.url}/api/v1/stream"
    await guarded.call("GET", "/api/v1/vehicles", headers={"Authorization": f"Bearer {secret}"})
    async with guarded.http.ws_connect(url, protocols=("waydrop.v1", f"bearer.{secret}")) as socket:
        await socket.receive_json()
    status, _, problem = await guarded.call(
        "GET",
        "/api/v1/stream",
        headers={
            "Connection": "Upgrade",
            "Upgrade": "websocket",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": "MDEyMzQ1Njc4OWFiY2RlZg==",
            "Sec-WebSocket-Protocol": f"bearer.{secret}",
        },
    )
    assert (status, problem["code"]) == (400, "stream.subprotocol")
    out, err = capfd.readouterr()
    assert "request" in out + err
    assert secret not in out + err
