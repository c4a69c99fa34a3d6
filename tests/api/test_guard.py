"""No web page but our own can make the service do anything, even on a tokenless loopback."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from app.api.application import ROUTES
from app.api.routing import PROBED
from app.services.access import Role
from tests.support.guarded import path_of
from tests.support.service_in_process import SETTINGS, Service, run_service

STATE_CHANGING = [route for route in ROUTES if route.method != "GET"]
FOREIGN_PAGES = [
    {"Origin": "https://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1:1"},
    {"Origin": "http://127.0.0.1.evil.example"},
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
]


@pytest.mark.parametrize("headers", FOREIGN_PAGES, ids=lambda headers: " ".join(headers.values()))
async def test_a_foreign_page_can_post_to_no_route(service: Service, headers: dict[str, str]) -> None:
    assert len(STATE_CHANGING) >= 12
    for route in STATE_CHANGING:
        status, _, problem = await service.call(route.method, path_of(route), json={}, headers=headers)
        assert (status, problem["code"]) == (403, "origin.not_allowed"), route.path


async def test_a_rebound_name_reaches_no_route_but_the_probes(service: Service) -> None:
    for host in (
        "evil.example",
        f"evil.example:{service.port}",
        "127.0.0.1.evil.example",
        "localhost.evil",
        "[::2]",
        "",
    ):
        for route in ROUTES:
            status, _, problem = await service.call(route.method, path_of(route), headers={"Host": host})
            if route.path in PROBED:
                assert status == 200
            else:
                assert (status, problem["code"]) == (421, "host.not_allowed"), (host, route.path)
    for path in ("/", "/nowhere", "/api/v1/docs"):
        status, _, _ = await service.call("GET", path, headers={"Host": "evil.example"})
        assert status == 421


async def test_loopback_names_and_configured_names_are_answered(tmp_path: Path) -> None:
    settings = replace(SETTINGS, allowed_hosts=("Drones.Example",))
    async with run_service(tmp_path, settings=settings) as service:
        hosts = (
            "localhost",
            f"localhost:{service.port}",
            "127.0.0.1",
            "[::1]:8080",
            "drones.example",
            "DRONES.example:443",
        )
        token = await service.token(Role.VIEWER)
        for host in hosts:
            status, _, _ = await service.call("GET", "/api/v1/vehicles", headers={**token, "Host": host})
            assert status == 200, host


async def test_our_own_page_a_configured_page_and_programs_may_post(tmp_path: Path) -> None:
    settings = replace(SETTINGS, allowed_origins=("https://desk.example",))
    async with run_service(tmp_path, settings=settings) as service:
        for headers in (
            {},
            {"Origin": service.url, "Sec-Fetch-Site": "same-origin"},
            {"Origin": "https://desk.example", "Sec-Fetch-Site": "cross-site"},
            {"Sec-Fetch-Site": "none"},
        ):
            status, _, problem = await service.call("POST", "/api/v1/vehicles/v1/land", headers=headers)
            assert (status, problem["code"]) == (409, "state.conflict"), headers  # it got through to the vehicle


@pytest.mark.parametrize(
    "headers", [*FOREIGN_PAGES, {"Host": "evil.example"}], ids=lambda headers: " ".join(headers.values())
)
async def test_a_foreign_page_opens_no_socket(service: Service, headers: dict[str, str]) -> None:
    with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
        await service.http.ws_connect(f"{service.url}/api/v1/stream", headers=headers)
    assert refused.value.status == (421 if "Host" in headers else 403)


async def test_our_own_page_opens_a_socket(service: Service) -> None:
    headers = {"Origin": service.url, "Sec-Fetch-Site": "same-origin"}
    async with service.http.ws_connect(f"{service.url}/api/v1/stream", headers=headers) as socket:
        assert (await socket.receive_json())["type"] == "hello"


@pytest.mark.parametrize(
    "content_type",
    ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "application/xml"],
)
async def test_a_body_that_a_form_could_send_is_not_taken(
    service: Service, plan: dict[str, Any], content_type: str
) -> None:
    for route in STATE_CHANGING:
        status, _, problem = await service.call(
            route.method, path_of(route), data=b"{}", headers={"Content-Type": content_type}
        )
        assert (status, problem["code"]) == (415, "request.content_type"), route.path


async def test_other_origins_are_told_nothing_by_cors(service: Service) -> None:
    status, headers, _ = await service.call("GET", "/api/v1/vehicles", headers={"Origin": "https://evil.example"})
    assert status == 200
    assert not [name for name in headers if name.lower().startswith("access-control-")]
    status, headers, _ = await service.call(
        "OPTIONS", "/api/v1/plans", headers={"Origin": "https://evil.example", "Access-Control-Request-Method": "POST"}
    )
    assert status == 405
    assert not [name for name in headers if name.lower().startswith("access-control-")]
