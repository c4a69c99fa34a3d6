"""Errors: always a problem document with a stable code, never a trace."""

from __future__ import annotations

import asyncio
import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.api.application import ROUTES
from app.api.problems import PROBLEMS, ApiError, kind_of, problem_response
from app.api.websockets import refused
from app.domain import errors
from tests.api.broken_parts import with_defect, without_journal
from tests.support.guarded import path_of
from tests.support.service_in_process import SETTINGS, Service, run_service


def all_errors(base: type[errors.WaydropError] = errors.WaydropError) -> list[type[errors.WaydropError]]:
    """Every expected error of the domain."""
    return [cls for found in base.__subclasses__() for cls in (found, *all_errors(found))]


@pytest.mark.parametrize("cls", [cls for cls in all_errors() if cls.__module__ == errors.__name__])
def test_every_error_of_the_domain_has_a_code_in_the_table(cls: type[errors.WaydropError]) -> None:
    kind = kind_of(cls("why"))
    assert PROBLEMS[cls.code] == kind
    assert 400 <= kind.status < 600


def test_an_error_with_a_code_of_its_own_answers_as_the_class_it_comes_from() -> None:
    class NoSuchTokenError(errors.NotFoundError):
        code = "token.unknown"

    assert (kind_of(NoSuchTokenError("x")).status, kind_of(NoSuchTokenError("x")).code) == (404, "token.unknown")
    assert kind_of(errors.WaydropError("x")).status == 500


@pytest.mark.parametrize("code", PROBLEMS)
def test_each_problem_says_what_to_do_with_a_hint_of_its_own_first(code: str) -> None:
    for given in ("", "try it so"):
        body = json.loads(bytes(problem_response(ApiError(code, "why", hint=given), request_id="r").body))  # type: ignore[arg-type]
        assert body["hint"], code
        assert given in ("", body["hint"])
        assert refused(None, ApiError(code, "why", hint=given)).hint == body["hint"]


def test_extra_facts_are_members_but_never_overwrite_the_standard_ones() -> None:
    error = errors.ConflictError("detail", hint="hint", status=1, code="x", title="t", speed_m_s=float("nan"), at={1})
    body = bytes(problem_response(error, request_id="r1").body)  # type: ignore[arg-type]
    assert b'"status":409' in body
    assert b'"code":"state.conflict"' in body
    assert b'"speed_m_s":null' in body


async def test_an_unknown_path_is_404_as_a_problem(service: Service) -> None:
    for path in (
        "/api/v1/nothing",
        "/api/v2/plans",
        "/nothing",
        "/api/v1/plans/",
        "/api/v1/plans/a/b",
        "/%00",
        "/x.js",
    ):
        status, headers, problem = await service.call("GET", path)
        assert (status, problem["code"]) == (404, "path.not_found"), path
        assert headers["Content-Type"] == "application/problem+json"
        assert problem["type"] == "/api/v1/problems#path.not_found"
        assert problem["request_id"] == headers["X-Request-ID"]


async def test_a_wrong_method_is_405_and_says_which_are_right(service: Service) -> None:
    for method, path, allowed in (
        ("PUT", "/api/v1/plans", "GET,HEAD,POST"),
        ("DELETE", "/api/v1/runs/x", "GET,HEAD"),
        ("GET", "/api/v1/runs/x/start", "POST"),
        ("POST", "/healthz", "GET,HEAD"),
        ("POST", "/", "GET,HEAD"),
        ("PROPFIND", "/api/v1/events", "GET,HEAD"),
    ):
        status, headers, problem = await service.call(method, path)
        assert (status, problem["code"]) == (405, "method.not_allowed"), path
        assert set(headers["Allow"].split(",")) == set(allowed.split(",")), path


async def test_a_body_that_is_not_json_is_400_where_it_is_not_a_plan(service: Service) -> None:
    headers = {"Content-Type": "application/json"}
    for raw in (b"{", b"\xff\xfe", b"plan=1", b"[" * 60_000, b'{"plan": NaN', b""):
        for path in ("/api/v1/runs", "/api/v1/plan-checks"):
            status, _, problem = await service.call("POST", path, data=raw, headers=headers)
            assert (status, problem["code"]) == (400, "request.malformed"), raw[:20]
        status, _, problem = await service.call("POST", "/api/v1/plans", data=raw, headers=headers)
        assert problem["code"] in ("plan.invalid", "request.malformed")


async def test_a_body_where_none_belongs_is_refused_but_an_empty_object_is_taken(service: Service) -> None:
    status, _, problem = await service.call("POST", "/api/v1/vehicles/v9/hold", json={"speed_m_s": 3})
    assert (status, problem["code"]) == (422, "request.invalid")
    status, _, problem = await service.call("POST", "/api/v1/vehicles/v9/hold", json={})
    assert (status, problem["code"]) == (404, "resource.not_found")


async def test_common_refusals_are_the_same_on_every_route(service: Service) -> None:
    for route in ROUTES:
        path = path_of(route)
        status, _, problem = await service.call(route.method, f"{path}?no_such_parameter=1")
        assert (status, problem["code"]) == (400, "request.query_invalid"), path
        if route.method != "GET":
            big = b'"' + b"x" * ((route.body.max_bytes or SETTINGS.max_body_bytes) + 1) + b'"'
            status, _, problem = await service.call(
                route.method, path, data=io.BytesIO(big), headers={"Content-Type": route.body.media[0]}
            )
            assert (status, problem["code"]) == (413, "request.too_large"), path
        status, _, problem = await service.call(route.method, path, headers={"Expect": "miracles"})
        assert (status, problem["code"]) == (417, "request.expectation"), path


async def test_a_body_that_never_ends_is_408(tmp_path: Path) -> None:
    async def endless() -> Any:
        yield b"{"
        await asyncio.sleep(30)
        yield b"}"

    async with run_service(tmp_path, settings=replace(SETTINGS, body_timeout_s=0.5)) as service:
        status, _, problem = await service.call(
            "POST", "/api/v1/plans", data=endless(), headers={"Content-Type": "application/json"}
        )
    assert (status, problem["code"]) == (408, "request.timeout")


async def test_a_client_that_asks_before_it_sends_is_told_to_go_on(service: Service, plan: dict[str, Any]) -> None:
    status, _, _ = await service.call("POST", "/api/v1/plans", json=plan, expect100=True)
    assert status == 201


async def test_a_defect_is_500_with_an_incident_that_the_log_has_and_no_trace(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    async with run_service(tmp_path, change=with_defect) as service:
        status, headers, problem = await service.call("GET", "/api/v1/vehicles")
        assert (status, problem["code"]) == (500, "service.internal_error")
        assert problem["request_id"] == headers["X-Request-ID"]
        text = str(problem)
        assert not re.search(r"Traceback|ZeroDivision|nobody outside|\.py", text)
        out = capfd.readouterr().out
        assert problem["request_id"] in out
        assert "ZeroDivisionError" in out
        status, _, _ = await service.call("GET", "/healthz")
        assert status == 200


async def test_a_defect_ends_a_socket_with_1011(tmp_path: Path) -> None:
    async with (
        run_service(tmp_path, change=with_defect) as service,
        service.http.ws_connect(f"{service.url}/api/v1/stream") as socket,
    ):
        async with asyncio.timeout(20):
            async for _ in socket:
                pass
        assert socket.close_code == 1011


async def test_a_journal_that_takes_nothing_is_503_and_not_ready(tmp_path: Path) -> None:
    async with run_service(tmp_path, change=without_journal) as service:
        status, headers, problem = await service.call("GET", "/api/v1/events")
        assert (status, problem["code"]) == (503, "storage.failed")
        assert int(headers["Retry-After"]) > 0
        status, _, ready = await service.call("GET", "/readyz")
        assert (status, ready["ready"]) == (503, False)
        assert "journal" in ready["reasons"]


async def test_a_request_id_of_the_client_is_kept_if_it_is_harmless(service: Service) -> None:
    _, headers, _ = await service.call("GET", "/healthz", headers={"X-Request-ID": "order-2041.a_b"})
    assert headers["X-Request-ID"] == "order-2041.a_b"
    for bad in ("two words", "x" * 65, "a;b", "é"):
        _, headers, _ = await service.call("GET", "/healthz", headers={"X-Request-ID": bad})
        assert re.fullmatch(r"[0-9a-f]{16}", headers["X-Request-ID"])


def test_a_code_that_is_not_in_the_table_is_a_defect_of_ours() -> None:
    assert kind_of(ApiError("no.such.code", "x")).status == 500
