"""The relay of a gateway: what its journal has stored goes to the cluster, in order.

It has no cursor of its own. The cluster's store says which events it has; the relay goes on after them, and sends
anew what was lost on the way.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Final

import structlog

from app.domain.cluster.envelope import Envelope
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.cluster.ports import CURSORS, Bus, EventsWanted, GatewaySeq, RelayLog, pages_of
from app.domain.errors import StorageError
from app.domain.ports.journal import EventReader
from app.services.background import end_tasks
from app.services.journal import SubscriptionClosedError, SubscriptionOverflowError

log = structlog.get_logger(__name__)

PAGE_EVENTS: Final = 200
MOST_BYTES: Final = 900_000
"""NATS takes messages of up to 1 MiB, unless it is configured otherwise."""
RETRY_S: Final = 0.25
ASK_TIMEOUT_S: Final = 5.0
WAKES: Final = 4096


class Relay:
    """Publishes the journal's events as they come. While NATS or the projection is away, the journal keeps them."""

    def __init__(self, site: str, gateway_id: str, relay_log: RelayLog, journal: EventReader, bus: Bus) -> None:
        self._site = site
        self._gateway_id = gateway_id
        self._log = relay_log
        self._journal = journal
        self._bus = bus
        self._published: int | None = None
        self._stack = AsyncExitStack()
        self._task: asyncio.Task[None] | None = None

    @property
    def behind(self) -> int | None:
        """How many events are not published yet; None while it is not known what the cluster has."""
        return None if self._published is None else self._journal.last_seq - self._published

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Publish while the block runs. It may run again."""
        await self.start()
        try:
            yield
        finally:
            await self.close()

    async def start(self) -> None:
        """Begin to publish, and to answer who misses events."""
        await self._stack.enter_async_context(self._bus.answering(pages_of(self._site, self._gateway_id), self._page))
        self._task = asyncio.create_task(self._run(), name="relay")

    async def close(self) -> None:
        """Stop. What is not published yet is after the next start. Idempotent."""
        await end_tasks(self._task)
        self._task = None
        await self._stack.aclose()

    async def _run(self) -> None:
        while True:
            try:
                if self._published is None:
                    self._published = await self.stored()
                await self._follow()
            except SubscriptionOverflowError:
                continue
            except SubscriptionClosedError:
                return
            except (BusDownError, GatewayUnreachableError, NoReplyError, StorageError) as error:
                log.debug("relay waits", error=error.detail)
                await asyncio.sleep(RETRY_S)

    async def stored(self) -> int:
        """The newest event of this gateway that the cluster's store has.

        Raises BusDownError, GatewayUnreachableError (nobody writes the store), NoReplyError.
        """
        asked = GatewaySeq(gateway=self._gateway_id).model_dump_json().encode()
        reply = await self._bus.request(CURSORS, asked, timeout_s=ASK_TIMEOUT_S)
        return GatewaySeq.model_validate_json(reply).seq

    async def _follow(self) -> None:
        subscription = self._journal.subscribe(WAKES)
        try:
            while True:
                await self._publish()
                await subscription.get()
        finally:
            subscription.close()

    async def _publish(self) -> None:
        while self._published is not None and self._published < self._journal.last_seq:
            envelope = await self._envelope(self._published, PAGE_EVENTS)
            await self._bus.publish_envelope(envelope)
            self._published = envelope.events[-1].seq

    async def _page(self, message: bytes) -> bytes:
        wanted = EventsWanted.model_validate_json(message)
        return (await self._envelope(wanted.after, min(max(wanted.limit, 1), PAGE_EVENTS))).to_json()

    async def _envelope(self, after: int, limit: int) -> Envelope:
        """A page that fits into a message."""
        while True:
            envelope = await self._log.envelope(self._site, after=after, limit=limit)
            if limit == 1 or len(envelope.to_json()) <= MOST_BYTES:
                return envelope
            limit //= 2
