"""Where an event is when, on its way from the commit to a client: at NATS, in PostgreSQL."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import asyncpg
import nats
from nats.aio.msg import Msg

from app.domain.cluster.ports import ALL_EVENTS
from app.storage.postgres.events import CHANNEL


class Stages:
    """The time at which each event, by its gateway and number, was published and stored."""

    def __init__(self) -> None:
        self.published: dict[tuple[str, int], float] = {}
        self.stored: dict[tuple[str, int], float] = {}
        self.envelopes = 0
        self.commits = 0

    async def on_message(self, message: Msg) -> None:
        """An envelope at NATS."""
        now_s = time.time()
        envelope = json.loads(message.data)
        self.envelopes += 1
        for event in envelope["events"]:
            self.published.setdefault((envelope["gateway"], event["seq"]), now_s)

    async def follow(self, connection: asyncpg.Connection) -> None:
        """Commits of the projection, until cancelled."""
        changed = asyncio.Event()
        await connection.add_listener(CHANNEL, lambda *_: changed.set())
        position = await connection.fetchval("SELECT position FROM stream")
        while True:
            await changed.wait()
            changed.clear()
            now_s = time.time()
            rows = await connection.fetch("SELECT position, gateway, seq FROM events WHERE position > $1", position)
            self.commits += 1
            for row in rows:
                self.stored[row["gateway"], row["seq"]] = now_s
                position = max(position, row["position"])


@asynccontextmanager
async def watched(nats_url: str, postgres_url: str) -> AsyncIterator[Stages]:
    """Watch while the block runs. It costs the machine something itself."""
    stages = Stages()
    client = await nats.connect(nats_url)
    connection = await asyncpg.connect(postgres_url)
    await client.subscribe(ALL_EVENTS, cb=stages.on_message)
    following = asyncio.create_task(stages.follow(connection), name="stages")
    try:
        yield stages
    finally:
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)
        await connection.close()
        await client.close()
