"""A client that does not read is cut, and the others feel nothing."""

from __future__ import annotations

import asyncio
import re
import time
from contextlib import AsyncExitStack
from dataclasses import replace
from pathlib import Path

from tests.support.listener import Listener, listen, record
from tests.support.raw_socket import DeafClient, close_frame
from tests.support.service_in_process import LOOK_AGAIN_S, SETTINGS, Service, run_service
from tests.support.slow_clients import closed

SMALL = replace(SETTINGS, socket_queue=64, socket_buffer_bytes=64 * 1024, close_grace_s=0.3)
OTHERS = 20
EVENTS = 200


async def all_see_everything(service: Service, clients: list[Listener]) -> None:
    """Record events, and wait until each client has got each of them, in order."""
    first = service.services.journal.last_seq + 1

    async def follow(client: Listener) -> list[int]:
        return [(await client.event())["seq"] for _ in range(EVENTS)]

    followers = [asyncio.create_task(follow(client)) for client in clients]
    for _ in range(EVENTS):
        await record(service, 1, size=8000)
    for seqs in await asyncio.gather(*followers):
        assert seqs == list(range(first, first + EVENTS))


async def test_a_client_that_never_reads_is_cut_and_twenty_others_do_not_wait_for_it(tmp_path: Path) -> None:
    """A service in which the others waited for a write to the deaf one would keep them waiting longer than they do."""
    settings = replace(SMALL, send_timeout_s=120.0)
    async with run_service(tmp_path, settings=settings) as service, AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(listen(service)) for _ in range(OTHERS)]
        for client in clients:
            await client.frame("snapshot")
        deaf = DeafClient(service.port)
        stack.callback(deaf.close)
        await deaf.open()
        await all_see_everything(service, clients)
        async with asyncio.timeout(60):
            while await closed(service, 4408) == 0:
                await asyncio.sleep(LOOK_AGAIN_S)
        assert all(not client.socket.closed for client in clients)
        await deaf.read_to_the_end()  # the connection has ended


async def test_a_client_that_reads_again_in_time_learns_why_it_was_cut(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=replace(SMALL, close_grace_s=60.0)) as service:
        deaf = DeafClient(service.port)
        await deaf.open()
        async with asyncio.timeout(20):
            while await closed(service, 4408) == 0:
                await record(service, 20, size=2000)
        await deaf.read_up_to(close_frame(4408))
        deaf.close()


async def test_a_client_that_reads_nothing_is_cut_even_when_its_queue_has_room(tmp_path: Path) -> None:
    settings = replace(SMALL, socket_queue=100_000, send_timeout_s=0.3)
    async with run_service(tmp_path, settings=settings) as service:
        deaf = DeafClient(service.port)
        await deaf.open()
        async with asyncio.timeout(20):
            while await closed(service, 4408) == 0:
                await record(service, 20, size=2000)
        deaf.close()


async def test_a_slow_client_that_comes_back_with_after_has_missed_nothing(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=SMALL) as service:
        deaf = DeafClient(service.port)
        await deaf.open()
        await record(service, 400, size=2000)
        deaf.close()
        async with listen(service, "?after=0") as client:
            assert await client.seqs_to(402) == list(range(1, 403))


async def test_a_client_that_pauses_and_reads_on_gets_each_event_once_and_in_order(tmp_path: Path) -> None:
    settings = replace(SMALL, socket_queue=1000, send_timeout_s=30.0)
    async with run_service(tmp_path, settings=settings) as service:
        deaf = DeafClient(service.port)
        await deaf.open()
        got = await deaf.read_up_to(b'"type":"snapshot"')
        first = (await record(service, 1))[0]
        for _ in range(3):  # more than all buffers hold, so that frames are queued
            last = (await record(service, 200, size=2000))[-1]
            got += await deaf.read_up_to(b'"seq":%d,"gateway"' % last)
            last = (await record(service, 1))[-1]  # nothing waits any more
            got += await deaf.read_up_to(b'"seq":%d,"gateway"' % last)
        seqs = [int(seq) for seq in re.findall(rb'"seq":(\d+),"gateway"', got)]
        assert seqs == list(range(first, last + 1))
        deaf.close()


async def test_a_replay_longer_than_the_queue_is_no_reason_to_be_cut(tmp_path: Path) -> None:
    async with run_service(tmp_path, settings=replace(SMALL, replay_page_events=7)) as service:
        await record(service, 500)
        writer = asyncio.create_task(record(service, 200))
        async with listen(service, "?after=0") as client:
            assert await client.seqs_to(702) == list(range(1, 703))
        await writer
        assert await closed(service, 4408) == 0


async def test_telemetry_never_queues_up_for_a_client_that_does_not_read(tmp_path: Path) -> None:
    async with (
        run_service(tmp_path, settings=replace(SMALL, send_timeout_s=30.0)) as service,
        AsyncExitStack() as stack,
    ):
        deaf = DeafClient(service.port)
        stack.callback(deaf.close)
        await deaf.open()
        async with listen(service) as client:
            for _ in range(100):
                await client.frame("telemetry")
            now = time.time()
            while (await client.frame("telemetry"))["time"] < now:
                pass  # sent before the machine stood still
        assert await closed(service, 4408) == 0
