"""The floor of `python -m bench.cluster`: what an API node does, by nats-py, asyncpg and aiohttp alone.

Usage: python -m bench.cluster_floor NATS_URL POSTGRES_URL

Events go from JetStream by COPY into a table, NOTIFY wakes a reader, and a websocket gets them one a frame. Reports of
vehicles are passed on as they are, five times a second. Nothing is parsed or verified. Prints its port.
"""

from __future__ import annotations

import asyncio
import sys
from typing import Final

import asyncpg
import nats
from aiohttp import web
from nats.aio.msg import Msg
from nats.js import JetStreamContext
from nats.js.api import RetentionPolicy, StreamConfig

BATCH: Final = 64
PAGE: Final = 500
PERIOD_S: Final = 0.2
TABLE: Final = "CREATE TABLE floor (position bigint PRIMARY KEY, data text NOT NULL)"


class BareNode:
    """All of it on one loop, as an API node."""

    def __init__(self, jetstream: JetStreamContext, writer: asyncpg.Connection, reader: asyncpg.Connection) -> None:
        self._jetstream = jetstream
        self._writer = writer
        self._reader = reader
        self._changed = asyncio.Event()
        self._reports: dict[str, bytes] = {}
        self._sockets: set[web.WebSocketResponse] = set()

    async def on_message(self, message: Msg) -> None:
        """A report of a gateway: only the newest counts."""
        self._reports[message.subject] = message.data

    async def project(self) -> None:
        """From JetStream into the table."""
        await self._jetstream.add_stream(
            StreamConfig(name="FLOOR", subjects=["floor.*"], retention=RetentionPolicy.WORK_QUEUE)
        )
        feed = await self._jetstream.pull_subscribe("floor.*", durable="floor", stream="FLOOR")
        position = 0
        while True:
            try:
                messages = await feed.fetch(BATCH, timeout=1.0)
            except (TimeoutError, nats.errors.Error):
                continue
            rows = [(number, one.data.decode()) for number, one in enumerate(messages, position + 1)]
            position += len(rows)
            async with self._writer.transaction():
                await self._writer.copy_records_to_table("floor", records=rows, columns=("position", "data"))
                await self._writer.execute("SELECT pg_notify('floor', '')")
            for message in messages:
                await message.ack()

    async def read(self) -> None:
        """From the table to the sockets."""
        await self._reader.add_listener("floor", lambda *_: self._changed.set())
        position = 0
        while True:
            await self._changed.wait()
            self._changed.clear()
            query = "SELECT position, data FROM floor WHERE position > $1 ORDER BY position LIMIT $2"
            while rows := await self._reader.fetch(query, position, PAGE):
                position = rows[-1]["position"]
                for socket in self._sockets:
                    for row in rows:
                        await socket.send_str(row["data"])

    async def send_reports(self) -> None:
        """The newest reports to the sockets."""
        while True:
            await asyncio.sleep(PERIOD_S)
            reports, self._reports = self._reports, {}
            if reports:
                frame = b"[" + b",".join(reports.values()) + b"]"
                for socket in tuple(self._sockets):
                    await socket.send_frame(frame, web.WSMsgType.TEXT)

    async def stream(self, request: web.Request) -> web.WebSocketResponse:
        """A client."""
        socket = web.WebSocketResponse(compress=False)
        await socket.prepare(request)
        self._sockets.add(socket)
        async for _ in socket:
            pass
        self._sockets.discard(socket)
        return socket


async def main(nats_url: str, postgres_url: str) -> None:
    """Until it is killed."""
    client = await nats.connect(nats_url, max_reconnect_attempts=-1, reconnect_time_wait=1)
    writer, reader = [await asyncpg.connect(postgres_url) for _ in range(2)]
    await writer.execute(TABLE)
    node = BareNode(client.jetstream(), writer, reader)
    await client.subscribe("waydrop.states.*", cb=node.on_message)
    application = web.Application()
    application.router.add_get("/stream", node.stream)
    runner = web.AppRunner(application)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    sys.stdout.write(f"{runner.addresses[0][1]}\n")
    sys.stdout.flush()
    await asyncio.gather(node.project(), node.read(), node.send_reports())


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
