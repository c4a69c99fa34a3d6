"""Nobody takes all sockets: not those who are refused, and not one token."""

from __future__ import annotations

from contextlib import AsyncExitStack, ExitStack
from dataclasses import replace
from pathlib import Path

from app.services.access import Role
from tests.support.raw_socket import DeafClient
from tests.support.service_in_process import SETTINGS, run_service
from tests.support.socket_limits import HANDSHAKE

STREAM = "/api/v1/stream"
FEW = replace(SETTINGS, max_sockets=4, max_sockets_per_token=2, max_refused_sockets=3, close_grace_s=20.0)


async def test_sockets_that_are_refused_take_none_from_those_that_are_not(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        clients = stack.enter_context(ExitStack())
        service = await stack.enter_async_context(run_service(tmp_path, settings=FEW))
        admin = await service.token(Role.ADMIN)
        for _ in range(12):
            deaf = DeafClient(service.port)
            clients.callback(deaf.close)
            await deaf.open()
        socket = await stack.enter_async_context(service.http.ws_connect(service.url + STREAM, headers=admin))
        assert (await socket.receive_json(timeout=60))["type"] == "hello"
        status, _, problem = await service.call("GET", STREAM, headers=HANDSHAKE)
        assert (status, problem["code"]) == (401, "auth.required"), "more of them are refused without a socket"
        clients.close()
        await socket.close()


async def test_one_token_has_its_share_and_another_one_gets_in(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=FEW) as service, AsyncExitStack() as stack:
        viewer, admin = await service.token(Role.VIEWER), await service.token(Role.ADMIN)
        for headers in (viewer, viewer, admin):
            socket = await stack.enter_async_context(service.http.ws_connect(service.url + STREAM, headers=headers))
            assert (await socket.receive_json(timeout=60))["type"] == "hello"
        status, headers, problem = await service.call("GET", STREAM, headers=HANDSHAKE | viewer)
        assert (status, problem["code"]) == (429, "stream.token_limit_reached")
        assert int(headers["Retry-After"]) > 0


async def test_without_tokens_the_person_at_this_machine_may_have_them_all(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=FEW) as service, AsyncExitStack() as stack:
        for _ in range(FEW.max_sockets):
            socket = await stack.enter_async_context(service.http.ws_connect(service.url + STREAM))
            assert (await socket.receive_json(timeout=60))["type"] == "hello"
