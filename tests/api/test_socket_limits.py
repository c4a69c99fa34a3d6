"""How many sockets there may be, what they may send, and how they end."""

from __future__ import annotations

import asyncio
import time
from contextlib import AsyncExitStack, ExitStack, suppress
from dataclasses import replace
from pathlib import Path

import aiohttp
import pytest

from app.api import ApiServices
from app.services.access import Access
from tests.support.listener import listen, record
from tests.support.raw_socket import DeafClient, close_frame
from tests.support.service_in_process import SETTINGS, Service, run_service
from tests.support.slow_clients import closed
from tests.support.socket_limits import HANDSHAKE, sockets_open


async def test_more_sockets_than_allowed_are_refused_and_room_is_given_back(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=replace(SETTINGS, max_sockets=3)) as service, AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(listen(service)) for _ in range(3)]
        status, headers, problem = await service.call("GET", "/api/v1/stream", headers=HANDSHAKE)
        assert (status, problem["code"]) == (503, "stream.limit_reached")
        assert int(headers["Retry-After"]) > 0
        await clients[0].socket.close()
        async with asyncio.timeout(20):
            while True:
                try:
                    clients.append(await stack.enter_async_context(listen(service)))
                    break
                except aiohttp.WSServerHandshakeError:
                    await asyncio.sleep(0.01)
        assert (await clients[-1].frame("hello"))["type"] == "hello"


async def test_a_plain_get_of_the_stream_is_told_to_upgrade(service: Service) -> None:
    status, headers, problem = await service.call("GET", "/api/v1/stream")
    assert (status, problem["code"]) == (426, "stream.upgrade_required")
    assert headers["Upgrade"] == "websocket"
    assert "/api/v1/events" in problem["hint"]


@pytest.mark.parametrize("headers", [{}, HANDSHAKE], ids=["plain", "handshake"])
@pytest.mark.parametrize("path", ["/api/v1/stream", "/api/v1/targets/ship-1/reports"])
async def test_a_head_request_is_answered_as_a_plain_get(service: Service, path: str, headers: dict[str, str]) -> None:
    async with service.http.head(service.url + path, headers=headers) as response:
        assert (response.status, response.headers["Upgrade"]) == (426, "websocket")


@pytest.mark.parametrize("path", ["/api/v1/vehicles/v1/offboard", "/api/v1/targets/ship-1/reports"])
async def test_a_socket_without_parameters_closes_with_4400_if_it_is_given_one(service: Service, path: str) -> None:
    async with service.http.ws_connect(f"{service.url}{path}?rate_hz=20") as socket:
        message = await socket.receive(timeout=60)
        assert (message.type, message.data) == (aiohttp.WSMsgType.CLOSE, 4400)


@pytest.mark.parametrize(
    "headers", [{"Sec-WebSocket-Key": "short"}, {"Sec-WebSocket-Version": "99"}, {"Connection": "close"}]
)
async def test_a_handshake_that_is_none_is_a_client_error(service: Service, headers: dict[str, str]) -> None:
    status, _, problem = await service.call("GET", "/api/v1/stream", headers=HANDSHAKE | headers)
    assert status == 400
    assert problem["code"] == "request.not_http"


async def test_what_a_client_says_is_passed_over_but_not_for_ever(service: Service) -> None:
    async with listen(service) as client:
        for _ in range(50):
            await client.socket.send_str("hello?")
        await client.socket.send_bytes(b"\x00")
        await record(service, 1)
        await client.event()
        with suppress(ConnectionResetError):  # the service may have closed before all are sent
            for _ in range(100):
                await client.socket.send_str("hello?")
        assert await client.close_code() == 1008


async def test_a_message_that_is_too_large_closes_with_1009(service: Service) -> None:
    async with listen(service) as client:
        await client.socket.send_str("x" * 5000)
        assert await client.close_code() == 1009
    await sockets_open(service, 0)
    assert await closed(service, 1009) == 1


async def test_a_client_that_leaves_was_not_closed_by_the_service(service: Service) -> None:
    async with listen(service) as client:
        await client.frame("hello")
        await client.socket.close(code=1009)
    await sockets_open(service, 0)
    assert await closed(service, 1009) == 0


async def test_a_client_that_does_not_answer_pings_is_let_go(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=replace(SETTINGS, heartbeat_s=0.2)) as service:
        deaf = DeafClient(service.port)
        await deaf.open()
        await deaf.read_to_the_end(timeout_s=25)  # at the 20 s of the settings it would be let go after 30 s
        deaf.close()


@pytest.fixture
def patient_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stop waits for handlers so long that a busy machine gets through them, and that a hang is seen."""
    monkeypatch.setattr("app.api.server.SHUTDOWN_S", 60.0)


@pytest.mark.usefixtures("patient_stop")
async def test_a_stop_closes_sockets_with_1001_and_does_not_wait_for_a_deaf_one(tmp_path: Path) -> None:
    async with AsyncExitStack() as clients:
        async with run_service(tmp_path, settings=replace(SETTINGS, close_grace_s=0.5)) as service:
            deaf = DeafClient(service.port)
            clients.callback(deaf.close)
            await deaf.open()
            url = f"{service.url}/api/v1/stream"
            http = await clients.enter_async_context(aiohttp.ClientSession())
            socket = await clients.enter_async_context(http.ws_connect(url))
            await socket.receive_json()
            reader = asyncio.create_task(_to_the_end(socket))
            begun = time.monotonic()
        assert time.monotonic() - begun < 30
        assert await reader == 1001
        assert close_frame(1001) in await deaf.read_to_the_end()


class SlowAccess(Access):
    """Says who somebody is only once the gate is open."""

    def __init__(self, access: Access) -> None:
        vars(self).update(vars(access))
        self.asked, self.gate = asyncio.Event(), asyncio.Event()

    async def has_tokens(self) -> bool:
        self.asked.set()
        await self.gate.wait()
        return await super().has_tokens()


@pytest.mark.usefixtures("patient_stop")
@pytest.mark.parametrize("path", ["/api/v1/stream", "/api/v1/vehicles/v1/offboard", "/api/v1/targets/ship-1/reports"])
async def test_a_socket_that_is_being_opened_as_the_service_stops_is_ended_with_1001_too(
    tmp_path: Path, path: str
) -> None:
    slow: list[SlowAccess] = []

    def slowly(services: ApiServices) -> ApiServices:
        slow.append(SlowAccess(services.access))
        return replace(services, access=slow[0])

    with ExitStack() as clients:
        async with run_service(tmp_path, change=slowly) as service:
            deaf = DeafClient(service.port)
            clients.callback(deaf.close)
            await deaf.open(path)
            async with asyncio.timeout(60):
                await slow[0].asked.wait()
            # A stop ends the sockets there are at once, then waits for handlers under way: this one goes on meanwhile.
            asyncio.get_running_loop().call_later(0.5, slow[0].gate.set)
        assert close_frame(1001) in await deaf.read_to_the_end()


async def _to_the_end(socket: aiohttp.ClientWebSocketResponse) -> int | None:
    async for _ in socket:
        pass
    return socket.close_code


async def test_a_client_that_leaves_is_forgotten(service: Service) -> None:
    async with listen(service) as client:
        await client.frame("snapshot")
    await sockets_open(service, 0)
    assert await closed(service, 4408) == 0


async def test_a_client_that_vanishes_in_the_middle_disturbs_nobody(service: Service) -> None:
    async with listen(service) as client:
        await client.frame("snapshot")
        for _ in range(5):
            deaf = DeafClient(service.port)
            await deaf.open("/api/v1/stream?after=0")
            deaf.close()
        last = service.services.journal.last_seq
        assert await asyncio.gather(record(service, 100), client.seqs_to(last + 100))
