"""Moving targets reported over a websocket: the same reports and the same refusals as over REST, frame by frame."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from aiohttp import WSMsgType
from jsonschema_rs import Draft202012Validator

from app.api.websockets import CloseCode
from app.services.access import Role
from app.services.remote.targets import SharedTargets
from tests.support.memory_cluster import MemoryBus
from tests.support.raw_socket import DeafClient
from tests.support.service_in_process import SETTINGS, Service, run_service
from tests.support.slow_clients import closed
from tests.support.socket_limits import HANDSHAKE, sockets_open
from tests.support.targets_api import StillClock, clock, report, report_target, service

__all__ = ["clock", "service"]

PATH = "/api/v1/targets/ship-1/reports"


@asynccontextmanager
async def reporter(service: Service, **options: Any) -> AsyncIterator[aiohttp.ClientWebSocketResponse]:
    async with service.http.ws_connect(service.url + PATH, **options) as socket:
        yield socket


async def answer(socket: aiohttp.ClientWebSocketResponse, frame: dict[str, Any]) -> dict[str, Any]:
    await socket.send_json(frame)
    return dict(await socket.receive_json(timeout=60))


async def close_code(socket: aiohttp.ClientWebSocketResponse) -> int | None:
    assert (await socket.receive(timeout=60)).type is WSMsgType.CLOSE
    return socket.close_code


async def test_each_report_is_taken_and_moves_what_is_known_of_the_target(service: Service, clock: StillClock) -> None:
    async with reporter(service) as socket:
        for number, east_m in enumerate((0, 10, 20)):
            clock.passed_s = float(number)
            said = report(east_m, age_s=0.5 - number)
            taken = await answer(socket, {"type": "report", "id": number, "report": said})
            assert (taken["type"], taken["id"]) == ("report_ack", number)
            _, _, known = await service.call("GET", "/api/v1/targets/ship-1")
            assert taken["target"] == known
            assert (known["report"], known["age_s"]) == (said, 0.5)
    await sockets_open(service, 0)
    status, _, known = await service.call("GET", "/api/v1/targets/ship-1")
    assert (status, known["report"]) == (200, said), "a target outlives the socket that reported it"


@pytest.mark.parametrize("body", [report(age_s=60), report(age_s=-600)], ids=["older", "ahead"])
async def test_what_rest_refuses_is_refused_in_the_same_words(service: Service, body: dict[str, float]) -> None:
    await report_target(service, report(age_s=2))
    _, problem = await report_target(service, body)
    async with reporter(service) as socket:
        refused = await answer(socket, {"type": "report", "id": 7, "report": body})
        assert (refused["type"], refused["id"]) == ("error", 7)
        assert {key: refused[key] for key in ("code", "detail", "hint")} == {
            key: problem[key] for key in ("code", "detail", "hint")
        }
        assert (await answer(socket, {"type": "report", "report": report()}))["type"] == "report_ack"


RUBBISH = {
    "nothing": ("", None),
    "no json": ("ship ahoy", None),
    "no object": ("[]", None),
    "a lone surrogate": ('"\\ud83d"', None),
    "another type": ('{"type": "acquire_lease", "id": 3}', 3),
    "no report": ('{"type": "report", "id": 3}', 3),
    "too fast": ('{"type": "report", "id": 3, "report": {"north_m_s": 1000}}', 3),
    "an id that is none": ('{"type": "report", "id": "3"}', None),
}


@pytest.mark.parametrize(("text", "said_id"), RUBBISH.values(), ids=RUBBISH.keys())
async def test_what_is_no_report_is_refused_and_the_socket_stays(
    service: Service, text: str, said_id: int | None
) -> None:
    async with reporter(service) as socket:
        await socket.send_str(text)
        refused = await socket.receive_json(timeout=60)
        assert (refused["type"], refused["code"], refused["id"]) == ("error", "request.invalid", said_id)
        assert refused["detail"]
        assert (await service.call("GET", "/api/v1/targets/ship-1"))[0] == 404
        assert (await answer(socket, {"type": "report", "report": report()}))["type"] == "report_ack"


async def test_the_answers_are_as_described(service: Service) -> None:
    _, _, document = await service.call("GET", "/api/v1/asyncapi.json")
    messages = document["channels"]["reports"]["messages"]
    async with reporter(service) as socket:
        for said in ({"type": "report", "id": 1, "report": report()}, {"type": "report"}):
            frame = await answer(socket, said)
            key = messages[frame["type"]]["$ref"].rpartition("/")[2]
            schema = {**document["components"]["messages"][key]["payload"], "components": document["components"]}
            assert [error.message for error in Draft202012Validator(schema).iter_errors(frame)] == []


async def test_binary_frames_and_frames_too_large_end_the_socket(service: Service) -> None:
    async with reporter(service) as socket:
        await socket.send_bytes(b"\x00")
        assert await close_code(socket) == CloseCode.UNSUPPORTED
    async with reporter(service) as socket:
        await socket.send_str("x" * 5000)
        assert await close_code(socket) == 1009


async def test_a_dispatcher_may_report(service: Service) -> None:
    async with reporter(service, headers=await service.token(Role.DISPATCHER)) as socket:
        assert (await answer(socket, {"type": "report", "report": report()}))["type"] == "report_ack"


async def test_a_handshake_that_cannot_be_is_a_client_error(service: Service) -> None:
    status, _, problem = await service.call("GET", "/api/v1/targets/a%20ship/reports", headers=HANDSHAKE)
    assert (status, problem["code"]) == (422, "input.invalid")
    status, _, problem = await service.call("GET", PATH)
    assert (status, problem["code"]) == (426, "stream.upgrade_required")
    foreign = HANDSHAKE | {"Origin": "https://evil.example"}
    status, _, problem = await service.call("GET", PATH, headers=foreign)
    assert (status, problem["code"]) == (403, "origin.not_allowed")


async def test_a_revoked_token_ends_the_socket(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=replace(SETTINGS, access_again_s=0.05)) as running:
        token, secret = await running.access.create_token("lost", Role.DISPATCHER)
        async with reporter(running, headers={"Authorization": f"Bearer {secret}"}) as socket:
            assert (await answer(socket, {"type": "report"}))["type"] == "error"
            await running.access.revoke(token.id)
            assert await close_code(socket) == CloseCode.UNAUTHORIZED


async def test_more_sockets_than_allowed_are_refused(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=replace(SETTINGS, max_sockets=1)) as running, reporter(running):
        status, headers, problem = await running.call("GET", PATH, headers=HANDSHAKE)
        assert (status, problem["code"]) == (503, "stream.limit_reached")
        assert int(headers["Retry-After"]) > 0


async def test_a_client_that_does_not_read_its_answers_is_cut(tmp_path: Path) -> None:
    settings = replace(SETTINGS, socket_buffer_bytes=4096, send_timeout_s=0.3, close_grace_s=0.3)
    async with run_service(tmp_path, settings=settings) as running:
        deaf = DeafClient(running.port)
        await deaf.open(PATH)
        talking = asyncio.create_task(deaf.send_forever(b"no report"))
        async with asyncio.timeout(30):
            while await closed(running, CloseCode.TOO_SLOW) == 0:
                await asyncio.sleep(0.02)
            await talking  # the connection has ended
        deaf.close()


async def test_a_stop_of_the_service_ends_the_socket(service: Service) -> None:
    async with reporter(service) as socket:
        assert (await answer(socket, {"type": "report"}))["type"] == "error"
        await service.app.shutdown()
        assert await close_code(socket) == CloseCode.GOING_AWAY


async def test_a_report_that_reaches_no_gateway_is_refused_and_not_shown(tmp_path: Path, clock: StillClock) -> None:
    bus = MemoryBus()
    targets = SharedTargets(clock, bus)
    async with (
        run_service(tmp_path, change=lambda services: replace(services, targets=targets)) as node,
        reporter(node) as socket,
    ):
        assert (await report_target(node, report(age_s=2)))[0] == 200
        bus.down = True
        status, problem = await report_target(node, report())
        assert (status, problem["code"]) == (503, "cluster.bus_down")
        refused = await answer(socket, {"type": "report", "id": 7, "report": report()})
        assert (refused["type"], refused["id"], refused["code"]) == ("error", 7, "cluster.bus_down")
        _, _, known = await node.call("GET", "/api/v1/targets/ship-1")
        assert known["age_s"] == 2, "gateways have no newer report"
        bus.down = False
        assert (await answer(socket, {"type": "report", "report": report()}))["type"] == "report_ack"
