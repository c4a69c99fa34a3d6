"""Pages of allowed origins use the API from a browser, which asks before and hides what it is not told to show."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support.service_in_process import SETTINGS, Service, run_service

DESK = "https://desk.example"
PREFLIGHT = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "authorization,idempotency-key"}
ALLOW_ORIGIN = "Access-Control-Allow-Origin"


@pytest.fixture
async def open_service(tmp_path: Path) -> AsyncIterator[Service]:
    """A service that pages of the desk may use."""
    async with run_service(tmp_path, settings=replace(SETTINGS, allowed_origins=(f"{DESK}/",))) as service:
        yield service


async def options(service: Service, path: str, headers: dict[str, str]) -> tuple[int, Any]:
    async with service.http.options(service.url + path, headers=headers) as response:
        return response.status, response.headers


def listed(header: str) -> set[str]:
    return {name.strip().lower() for name in header.split(",")}


async def test_a_preflight_of_an_allowed_page_is_answered(open_service: Service) -> None:
    for path in ("/api/v1/plans", "/api/v1/runs/r/pause", "/api/v1/nowhere"):
        status, headers = await options(open_service, path, {"Origin": DESK, **PREFLIGHT})
        assert (status, headers[ALLOW_ORIGIN], headers["Vary"]) == (204, DESK, "Origin"), path
        assert {"post", "patch", "delete"} <= listed(headers["Access-Control-Allow-Methods"])
        asked = {"authorization", "content-type", "idempotency-key", "if-none-match"}
        assert asked <= listed(headers["Access-Control-Allow-Headers"])
        assert "Access-Control-Allow-Credentials" not in headers


async def test_a_preflight_of_another_page_is_not_answered(open_service: Service) -> None:
    for origin in ("https://evil.example", "null", "http://desk.example", f"{DESK}.evil.example"):
        status, headers = await options(open_service, "/api/v1/plans", {"Origin": origin, **PREFLIGHT})
        assert (status, headers["Vary"]) == (405, "Origin"), origin
        assert ALLOW_ORIGIN not in headers
    status, headers = await options(
        open_service, "/api/v1/plans", {"Origin": DESK, "Host": "evil.example", **PREFLIGHT}
    )
    assert status == 421


async def test_an_allowed_page_can_read_answers_and_errors_with_their_headers(
    open_service: Service, plan: dict[str, Any]
) -> None:
    headers = {"Origin": DESK, "Idempotency-Key": "a-key"}
    status, answered, made = await open_service.call("POST", "/api/v1/plans", json=plan, headers=headers)
    assert (status, answered[ALLOW_ORIGIN]) == (201, DESK)
    exposed = listed(answered["Access-Control-Expose-Headers"])
    assert {"location", "etag", "retry-after", "idempotency-replayed"} <= exposed
    status, answered, _ = await open_service.call("GET", f"/api/v1/plans/{made['id']}", headers={"Origin": DESK})
    assert (status, answered[ALLOW_ORIGIN], answered["Vary"]) == (200, DESK, "Origin")
    status, answered, _ = await open_service.call("GET", "/api/v1/runs/nothing", headers={"Origin": DESK})
    assert (status, answered[ALLOW_ORIGIN]) == (404, DESK)
    _, answered, _ = await open_service.call("GET", "/api/v1/runs", headers={"Origin": DESK})
    assert listed(answered["Vary"]) == {"accept", "origin"}


async def test_other_pages_and_programs_get_no_permission(open_service: Service) -> None:
    for headers in ({"Origin": "https://evil.example"}, {}):
        status, answered, _ = await open_service.call("GET", "/api/v1/vehicles", headers=headers)
        assert (status, answered["Vary"]) == (200, "Origin")
        assert ALLOW_ORIGIN not in answered


async def test_without_the_setting_nothing_is_said_about_origins(service: Service) -> None:
    status, headers = await options(service, "/api/v1/plans", {"Origin": DESK, **PREFLIGHT})
    assert status == 405
    assert not {ALLOW_ORIGIN, "Vary"} & set(headers)
