"""Whatever is sent, there is an answer, and it is never a 500."""

from __future__ import annotations

import asyncio
import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.support.paths import PLANS
from tests.support.raw_socket import exchange, status_of
from tests.support.service_in_process import SETTINGS, Service, run_service

JSON = {"Content-Type": "application/json"}
HEADERS = [
    *("Authorization", "Idempotency-Key", "If-None-Match", "X-Request-ID", "Origin", "Content-Type", "Host", "Expect"),
    *("Upgrade", "Accept", "Cookie", "Range", "Sec-WebSocket-Protocol", "Sec-WebSocket-Version", "Sec-Fetch-Site"),
    *("Content-Encoding", "X-Forwarded-For"),
]
PLAN: dict[str, Any] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
ONE_SERVICE = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)

numbers = st.one_of(
    st.integers(), st.floats(), st.sampled_from([0, -0.0, 1e308, 90, -90.0000001, 180, 2**63, 10**400, 47.4, 1e-320])
)
leaves = st.one_of(
    st.none(), st.booleans(), numbers, st.text(max_size=8), st.sampled_from(["land", "v1", "\ud800", "\0"])
)
values = st.recursive(
    leaves,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


def places(node: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Every place in a document."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path, *(place for key, value in items for place in places(value, (*path, key)))]


@st.composite
def bent_plans(draw: st.DrawFn) -> Any:
    """A good plan with a few places replaced, removed, repeated or added to."""
    document: Any = copy.deepcopy(PLAN)
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.sampled_from(places(document)[1:] or [()]))
        if not place:
            return draw(values)
        parent = document
        for key in place[:-1]:
            parent = parent[key]
        _bend(draw, parent, place[-1])
    return document


def _bend(draw: st.DrawFn, parent: Any, key: Any) -> None:
    change = draw(st.sampled_from(["replace", "remove", "repeat", "add", "swap"]))
    if change == "remove":
        del parent[key]
    elif change == "repeat" and isinstance(parent, list):
        parent.insert(key, copy.deepcopy(parent[key]))
    elif change == "add" and isinstance(parent, dict):
        parent[draw(st.sampled_from(["jump", "hold_s", "item_id", "speed_m_s", "x"]))] = draw(values)
    elif change == "swap" and isinstance(parent, list):
        parent.append(parent.pop(key))
    else:
        parent[key] = draw(values)


def sent(document: Any) -> bytes:
    """The document as a careless client writes it: NaN, Infinity and lone surrogates included."""
    return json.dumps(document).encode("utf-8", "surrogatepass")


@settings(ONE_SERVICE, max_examples=500)
@given(plan=bent_plans())
async def test_five_hundred_bent_plans_get_an_answer_each(service: Service, plan: Any) -> None:
    status, _, body = await service.call("POST", "/api/v1/plans", data=sent(plan), headers=JSON)
    assert status in (201, 422)
    if status == 422:
        assert body["findings"]
        assert all(finding["code"] and finding["message"] for finding in body["findings"])


@settings(ONE_SERVICE, max_examples=100)
@given(plan=bent_plans(), vehicle=st.one_of(st.none(), st.sampled_from(["v1", "v9"]), leaves))
async def test_bent_plans_can_be_checked(service: Service, plan: Any, vehicle: Any) -> None:
    body = sent({"plan": plan, "vehicle": vehicle})
    status, _, _ = await service.call("POST", "/api/v1/plan-checks", data=body, headers=JSON)
    assert status in (200, 400, 404, 422)


@settings(ONE_SERVICE, max_examples=100)
@given(
    body=st.one_of(st.binary(max_size=200), values.map(sent)),
    path=st.sampled_from(["plans", "runs", "plan-checks", "plan-conversions", "simulator/faults"]),
)
async def test_any_bytes_get_an_answer(service: Service, body: bytes, path: str) -> None:
    status, _, _ = await service.call("POST", f"/api/v1/{path}", data=body, headers=JSON)
    assert status in (400, 422)


@settings(ONE_SERVICE, max_examples=150)
@given(
    path=st.sampled_from(["/api/v1/events", "/api/v1/runs", "/api/v1/plans", "/api/v1/vehicles", "/readyz", "/"]),
    query=st.dictionaries(
        st.sampled_from(["after", "limit", "vehicle", "open", "x", ""]) | st.text(max_size=5), st.text(max_size=20)
    ),
)
async def test_any_query_gets_an_answer(service: Service, path: str, query: dict[str, str]) -> None:
    clean = {
        key.encode("utf-8", "replace").decode(): value.encode("utf-8", "replace").decode()
        for key, value in query.items()
    }
    status, _, _ = await service.call("GET", path, params=clean)
    assert status in (200, 400)


@settings(ONE_SERVICE, max_examples=150)
@given(
    name=st.sampled_from(HEADERS),
    value=st.binary(max_size=60),
    line=st.sampled_from(["GET /api/v1/vehicles", "POST /api/v1/plans", "GET /api/v1/stream", "GET /"]),
)
async def test_any_header_gets_an_answer(service: Service, name: str, value: bytes, line: str) -> None:
    value = value.replace(b"\r", b"").replace(b"\n", b"")
    body = b"{}" if line.startswith("POST") else b""
    request = (
        f"{line} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nContent-Length: {len(body)}\r\n".encode()
        + name.encode()
        + b": "
        + value
        + b"\r\n\r\n"
        + body
    )
    status = status_of(await exchange(service.port, request))
    assert 200 <= status < 500


@pytest.mark.parametrize(
    ("encoding", "body"),
    [
        ("Content-Encoding: gzip\r\nContent-Length: 4\r\n", b"junk"),
        ("Content-Encoding: deflate\r\nContent-Length: 2\r\n", b"{}"),
        ("Content-Encoding: br\r\nContent-Length: 2\r\n", b"{}"),
        ("Transfer-Encoding: chunked\r\n", b"zz\r\n{}\r\n"),
        ("Transfer-Encoding: chunked\r\n", b"2\r\n{}\r\n0\r\n\r\n"),
        ("Content-Length: 2\r\nContent-Length: 3\r\n", b"{}"),
        ("Content-Length: -1\r\n", b""),
        ("Transfer-Encoding: chunked\r\nContent-Length: 2\r\n", b"{}"),
    ],
)
async def test_a_body_that_breaks_its_own_encoding_is_a_client_error(
    service: Service, encoding: str, body: bytes
) -> None:
    head = "POST /api/v1/runs HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nContent-Type: application/json\r\n"
    answer = await exchange(service.port, f"{head}{encoding}\r\n".encode() + body)
    assert 400 <= status_of(answer) < 500


async def test_a_client_that_leaves_in_the_middle_of_its_body_is_no_defect(
    service: Service, capfd: pytest.CaptureFixture[str]
) -> None:
    head = "POST /api/v1/plans HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    with pytest.raises(TimeoutError):
        await exchange(service.port, f"{head}Content-Length: 99\r\n\r\n{{".encode(), timeout_s=0.1)
    async with asyncio.timeout(20):
        while 'route="/api/v1/plans"' not in (await service.call("GET", "/metrics"))[2]:
            await asyncio.sleep(0.01)
    assert "defect" not in capfd.readouterr().out


async def test_a_body_that_breaks_off_in_the_middle_is_a_client_error(tmp_path: Path) -> None:
    """aiohttp does not tell who reads a body that a later chunk of it is none: the time for a body ends it."""
    head = "POST /api/v1/runs HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nContent-Type: application/json\r\n"
    async with run_service(tmp_path, settings=replace(SETTINGS, body_timeout_s=0.5)) as service:
        reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
        writer.write(f"{head}Transfer-Encoding: chunked\r\n\r\n1\r\n{{\r\n".encode())
        await writer.drain()
        async with asyncio.timeout(20):
            while 'route="/api/v1/plans"' not in (await service.call("GET", "/metrics"))[2]:
                await service.call("GET", "/api/v1/plans")  # the server has turned since the first part came
        writer.write(b"zz\r\n")
        async with asyncio.timeout(20):
            answer = await reader.readuntil(b"\r\n\r\n")
        writer.close()
    assert 400 <= status_of(answer) < 500
    assert b"application/problem+json" in answer
