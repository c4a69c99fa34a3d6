"""Bodies that do not come: who sends them for nothing is told at once, and all of them together are bounded."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.support.raw_socket import status_of
from tests.support.service_in_process import SETTINGS, Service, run_service
from tests.support.uploads import JPEG, a_run, attach, path_of

LARGE = 512 * 1024
Peer = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def stalled(service: Service, run_id: str, *, size: str = f"Content-Length: {LARGE}") -> Peer:
    """An upload of which nothing but the head comes."""
    reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
    head = f"POST {path_of(run_id)} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: image/jpeg\r\n{size}\r\n\r\n"
    writer.write(head.encode())
    await writer.drain()
    return reader, writer


async def answer_to(peer: Peer) -> bytes:
    """The first that comes."""
    async with asyncio.timeout(90):  # longer than a body is waited for: then the answer is 408
        return await peer[0].read(65536)


async def test_an_upload_to_a_run_or_drop_that_is_none_is_refused_before_its_body_comes(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=replace(SETTINGS, body_timeout_s=60.0)) as service:
        peer = await stalled(service, "run-000000000000")
        answer = await answer_to(peer)
        assert status_of(answer) == 404
        assert b'"code":"resource.not_found"' in answer
        peer[1].close()


async def test_large_bodies_under_way_are_bounded_and_room_is_given_back(tmp_path: Path, plan: dict[str, Any]) -> None:
    settings = replace(SETTINGS, body_timeout_s=60.0, bodies_under_way_bytes=2 * LARGE)
    async with run_service(tmp_path, settings=settings) as service:
        run_id = await a_run(service, plan)
        held = [await stalled(service, run_id) for _ in range(2)]
        async with asyncio.timeout(60):
            while True:
                status, headers, problem = await attach(
                    service, run_id, b"\xff\xd8\xff\xe0" + b"x" * LARGE, "image/jpeg"
                )
                if status not in (200, 201):  # 200: it was attached before the first two took their room
                    break
        assert (status, problem["code"]) == (503, "request.body_memory_full")
        assert int(headers["Retry-After"]) > 0
        assert (await attach(service, run_id, JPEG, "image/jpeg"))[0] == 201, "small ones need no room"
        unsized = await stalled(service, run_id, size="Transfer-Encoding: chunked")
        assert status_of(await answer_to(unsized)) == 503, "what does not tell its size may be as large as any"
        for _, writer in (*held, unsized):
            writer.close()
        async with asyncio.timeout(60):
            while (await attach(service, run_id, b"\xff\xd8\xff\xe0" + b"y" * LARGE, "image/jpeg"))[0] != 201:
                await asyncio.sleep(0.02)
