"""Clients that send half a request, or open too much, shut nobody else out."""

from __future__ import annotations

import asyncio
import socket
import time
from contextlib import suppress

from app.api.connections import ConnectionLimits
from tests.support.connections import LIMITS, served
from tests.support.raw_socket import exchange, status_of

WHOLE = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
KEPT = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
HALF = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "
Peer = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def begun(port: int, sent: bytes, *, source: str = "127.0.0.1") -> Peer:
    """A connection that has sent something and stays open."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(source, 0))
    writer.write(sent)
    await writer.drain()
    return reader, writer


async def answered(port: int, *, source: str = "127.0.0.1") -> Peer:
    """A connection that has an answer and is kept."""
    reader, writer = await begun(port, KEPT, source=source)
    async with asyncio.timeout(10):
        assert (await reader.readline()).startswith(b"HTTP/1.1 200")
    return reader, writer


async def handled(port: int, *, source: str = "127.0.0.1") -> Peer:
    """A connection whose request is being handled, and will be for long."""
    reader, writer = await begun(port, b"GET /slow HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", source=source)
    async with asyncio.timeout(10):
        assert (await reader.readline()).startswith(b"HTTP/1.1 200")
    return reader, writer


async def rest_of(peer: Peer) -> bytes:
    """What the service still says, once it has closed."""
    async with asyncio.timeout(10):
        with suppress(ConnectionResetError):
            return await peer[0].read(-1)
    return b""


async def test_half_sent_requests_of_one_address_shut_out_neither_it_nor_others() -> None:
    async with served(LIMITS) as port:
        halves = [await begun(port, HALF) for _ in range(30)]
        assert status_of(await exchange(port, WHOLE)) == 200
        assert status_of(await exchange(port, WHOLE)) == 200
        assert await rest_of(halves[0]) == b"", "the oldest half-sent ones make room"
        for _, writer in halves:
            writer.close()


async def test_half_sent_requests_of_many_addresses_shut_nobody_out() -> None:
    async with served(LIMITS) as port:
        halves = [await begun(port, HALF, source=f"127.0.0.{2 + n % 9}") for n in range(40)]
        assert status_of(await exchange(port, WHOLE)) == 200
        for _, writer in halves:
            writer.close()


async def test_connections_that_were_answered_and_ask_nothing_more_shut_nobody_out() -> None:
    async with served(LIMITS) as port:
        kept = [await answered(port, source=f"127.0.0.{2 + n % 3}") for n in range(12)]
        assert status_of(await exchange(port, WHOLE)) == 200
        assert b"yes" in await rest_of(kept[0]), "the oldest makes room"
        for _, writer in kept:
            writer.close()


async def test_half_of_a_second_request_keeps_no_place_either() -> None:
    async with served(LIMITS) as port:
        kept = [await answered(port, source=f"127.0.0.{2 + n % 3}") for n in range(12)]
        for _, writer in kept:
            writer.write(HALF)
            await writer.drain()
        assert status_of(await exchange(port, WHOLE)) == 200
        for _, writer in kept:
            writer.close()


async def test_a_client_that_takes_nothing_of_its_answers_is_cut() -> None:
    async with served(ConnectionLimits(stall_s=0.5)) as port:
        deaf = socket.socket()
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.setblocking(False)
        loop = asyncio.get_running_loop()
        await loop.sock_connect(deaf, ("127.0.0.1", port))
        async with asyncio.timeout(20):
            with suppress(ConnectionError, TimeoutError):
                while True:  # what it asks for fills the buffers of both kernels
                    await loop.sock_sendall(deaf, b"GET /large HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
                    await asyncio.sleep(0.01)
        deaf.close()


async def test_a_request_whose_head_does_not_come_is_cut_however_it_dribbles() -> None:
    async with served(ConnectionLimits(head_s=0.5)) as port:
        since = time.monotonic()
        peer = await begun(port, HALF)

        async def dribble() -> None:
            with suppress(ConnectionError):
                while True:
                    peer[1].write(b"x")
                    await peer[1].drain()
                    await asyncio.sleep(0.05)

        dribbling = asyncio.create_task(dribble())
        await rest_of(peer)
        assert time.monotonic() - since >= 0.4
        dribbling.cancel()
        await asyncio.gather(dribbling, return_exceptions=True)
        peer[1].close()


async def test_a_kept_connection_that_asks_nothing_more_is_closed() -> None:
    async with served(ConnectionLimits(idle_s=0.3)) as port:
        peer = await answered(port)
        assert b"yes" in await rest_of(peer)
        peer[1].close()


async def test_one_address_may_have_so_many_and_another_one_still_gets_in() -> None:
    async with served(LIMITS) as port:
        kept = [await handled(port) for _ in range(8)]
        refused = await exchange(port, WHOLE)
        assert status_of(refused) == 503
        assert b"application/problem+json" in refused
        assert b'"code":"connection.limit_reached"' in refused
        peer = await answered(port, source="127.0.0.2")
        kept[0][1].close()
        await kept[0][1].wait_closed()
        for _, writer in (*kept, peer):
            writer.close()


async def test_what_is_let_go_counts_no_more() -> None:
    async with served(LIMITS) as port:
        for _ in range(40):
            assert status_of(await exchange(port, WHOLE)) == 200


async def test_over_all_addresses_there_are_at_most_so_many() -> None:
    async with served(LIMITS) as port:
        kept = [await handled(port, source=f"127.0.0.{2 + n % 3}") for n in range(12)]
        assert status_of(await exchange(port, WHOLE)) == 503
        for _, writer in kept:
            writer.close()
