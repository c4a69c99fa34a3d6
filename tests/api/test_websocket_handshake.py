"""Who gets through the door of a websocket, on every path alike: a browser sees only the close code."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import aiohttp
import pytest

from app.domain.errors import StorageError
from app.domain.events import Event
from app.services.access import Role
from tests.api.broken_parts import without_tokens
from tests.support.service_in_process import Service, run_service

STREAM = "/api/v1/stream"
OFFBOARD = "/api/v1/vehicles/v1/offboard"
REPORTS = "/api/v1/targets/ship-1/reports"
LEAST = {STREAM: Role.VIEWER, OFFBOARD: Role.PILOT, REPORTS: Role.DISPATCHER}


async def close_code(socket: aiohttp.ClientWebSocketResponse) -> int | None:
    while not (await socket.receive(timeout=60)).type.name.startswith("CLOS"):
        pass
    return socket.close_code


async def test_while_tokens_cannot_be_looked_at_every_socket_is_told_to_try_again(tmp_path: Path) -> None:
    async with run_service(tmp_path, change=without_tokens) as service:
        for path in LEAST:
            async with service.http.ws_connect(service.url + path) as socket:
                assert await close_code(socket) == 1013, path


@pytest.mark.parametrize("path", LEAST)
async def test_only_the_role_that_a_path_needs_and_those_above_it_get_through(service: Service, path: str) -> None:
    tokens = {role: await service.token(role) for role in Role}
    for role in Role:
        async with service.http.ws_connect(service.url + path, headers=tokens[role]) as socket:
            if role.allows(LEAST[path]):
                await socket.close()
            assert await close_code(socket) == (1000 if role.allows(LEAST[path]) else 4403), role
    for headers in ({}, {"Authorization": "Bearer nobody"}):
        async with service.http.ws_connect(service.url + path, headers=headers) as socket:
            assert await close_code(socket) == 4401, headers


async def test_a_replay_that_cannot_be_read_is_told_to_try_again(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def broken(after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        raise StorageError("the disk cannot be read")

    monkeypatch.setattr(service.services.journal, "read", broken)
    async with service.http.ws_connect(f"{service.url}{STREAM}?after=0") as socket:
        assert await close_code(socket) == 1013
