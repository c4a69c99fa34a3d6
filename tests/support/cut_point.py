"""A TCP proxy before a server that can be cut as a network is: connections stay open, and nothing passes."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

CHUNK_BYTES = 65_536


class CutPoint:
    """Made by `cut_point`. What was sent while it is cut arrives afterwards, unless its sender has given up."""

    def __init__(self, server_port: int) -> None:
        self._server_port = server_port
        self._passes = asyncio.Event()
        self._passes.set()
        self.port = 0
        self._clients = set[asyncio.StreamWriter]()

    def drop(self) -> None:
        """End the connections of clients: what a server answers now is lost."""
        for writer in self._clients:
            writer.transport.abort()

    def cut(self) -> None:
        """Let nothing pass, in either direction."""
        self._passes.clear()

    def heal(self) -> None:
        """Let everything pass again."""
        self._passes.set()

    def lose(self) -> None:
        """Let nothing pass on what is connected now: neither side learns of it, as when a firewall has forgotten it."""
        self.cut()
        self._passes = asyncio.Event()
        self._passes.set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """One connection, until either side ends it."""
        passes = self._passes
        self._clients.add(writer)
        try:
            await passes.wait()
            with suppress(ConnectionError):
                await self._connect(passes, reader, writer)
        finally:
            self._clients.discard(writer)
            writer.close()

    async def _connect(self, passes: asyncio.Event, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        server_reader, server_writer = await asyncio.open_connection("127.0.0.1", self._server_port)
        ways = (self._carry(passes, reader, server_writer), self._carry(passes, server_reader, writer))
        tasks = [asyncio.create_task(one, name="cut point") for one in ways]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            server_writer.close()

    async def _carry(self, passes: asyncio.Event, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while True:
            data = await reader.read(CHUNK_BYTES)
            await passes.wait()
            if not data:
                return
            writer.write(data)
            await writer.drain()


@asynccontextmanager
async def cut_point(server_port: int) -> AsyncIterator[CutPoint]:
    """A proxy on a port of its own while the block runs."""
    point, connections = CutPoint(server_port), set[asyncio.Task[None]]()

    async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.create_task(point.serve(reader, writer), name="cut point connection")
        connections.add(task)
        task.add_done_callback(connections.discard)

    server = await asyncio.start_server(accept, "127.0.0.1", 0)
    point.port = server.sockets[0].getsockname()[1]
    try:
        yield point
    finally:
        server.close()
        for task in connections:
            task.cancel()
        await asyncio.gather(*connections, return_exceptions=True)
