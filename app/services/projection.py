"""The projection: gateways' events into the cluster's store, each once, with its chain verified.

JetStream may lose messages that it has acknowledged. What is missing is asked of the gateway, whose journal has it.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from typing import Final

import structlog

from app.domain.cluster.envelope import (
    BrokenChainError,
    Envelope,
    EnvelopeVersionError,
    MissingEventsError,
    RelayedEvent,
    new_events,
)
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.cluster.ports import (
    CURSORS,
    Bus,
    EnvelopeFeed,
    EventsWanted,
    GatewayReport,
    GatewaySeq,
    ProjectionStore,
    ProjectionWriter,
    ReceivedEnvelope,
    pages_of,
)
from app.domain.errors import InvalidInputError, StorageError
from app.domain.events.event import JournalHead
from app.services.background import end_tasks
from app.services.clock import Clock

log = structlog.get_logger(__name__)

BATCH_ENVELOPES: Final = 64
PAGE_EVENTS: Final = 200
FEED_TIMEOUT_S: Final = 1.0
WAITING_TIMEOUT_S: Final = 0.2
"""What waits in the stream comes at once."""
PAGE_TIMEOUT_S: Final = 5.0
POSTPONED_S: Final = 2.0
RETRY_S: Final = 1.0
CHECK_S: Final = 1.0
"""How often a node that writes looks whether it still may: while no event comes, nothing else tells."""
Also = Callable[[ProjectionWriter], AbstractAsyncContextManager[object]]
WAITED_S: Final = 5.0
"""So long a node that begins to write stores what waited, before it does anything else for all."""
LATE_S: Final = 3.0
"""A gateway that has reported events for so long is asked for them."""


class Projection:
    """Runs on every API node. The one that has the store's lock writes; the others wait for it.

    `also` is what this node does as long as it writes, once it has stored what waited.
    """

    def __init__(self, store: ProjectionStore, bus: Bus, clock: Clock, also: Also = nullcontext) -> None:
        self._store = store
        self._bus = bus
        self._clock = clock
        self._also = also
        self._heads: dict[str, JournalHead] = {}  # with those that are being stored
        self._stored: dict[str, int] = {}
        self.broken: dict[str, str] = {}
        """Why the newest envelope of a gateway was refused, by gateway; until it sends one that follows."""
        self._reports: dict[str, GatewayReport] = {}
        self._late_since_s: dict[str, tuple[int, float]] = {}
        self._checked_s = -math.inf
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to wait for the lock."""
        self._task = asyncio.create_task(self._run(), name="projection")

    async def close(self) -> None:
        """Stop, and let another node write. Idempotent."""
        await end_tasks(self._task)
        self._task = None

    def hear(self, report: GatewayReport) -> None:
        """Take what a gateway has reported: its events are asked for if they do not come."""
        self._reports[report.gateway] = report

    def why_not_ready(self) -> str | None:
        """For /readyz: None while the task runs."""
        return "stopped" if self._task is None or self._task.done() else None

    async def _run(self) -> None:
        while True:
            try:
                async with self._store.leading() as writer:
                    log.info("this node writes gateways' events into the store")
                    await self._lead(writer)
            except (StorageError, BusDownError) as error:
                log.warning("projection waits", error=error.detail)
                await asyncio.sleep(RETRY_S)

    async def _lead(self, writer: ProjectionWriter) -> None:
        self._heads = dict(await writer.heads())
        self._stored = {gateway: head.seq for gateway, head in self._heads.items()}
        self._reports, self._late_since_s, self.broken = {}, {}, {}
        async with (
            self._bus.envelopes() as feed,
            self._bus.answering(CURSORS, self._cursor, in_queue_group=True),
        ):
            began_s = self._clock.monotonic()
            while await self._take(writer, feed, WAITING_TIMEOUT_S) and self._clock.monotonic() - began_s < WAITED_S:
                pass
            async with self._also(writer):
                while True:
                    await self._take(writer, feed)
                    await self._ask_late(writer)
                    await self._check(writer)

    async def _check(self, writer: ProjectionWriter) -> None:
        """Raises StorageError: another node may write by now."""
        if self._clock.monotonic() - self._checked_s >= CHECK_S:
            await writer.check()
            self._checked_s = self._clock.monotonic()

    async def _cursor(self, message: bytes) -> bytes:
        gateway = GatewaySeq.model_validate_json(message).gateway  # which may delete the events up to the answer
        return GatewaySeq(gateway=gateway, seq=self._stored.get(gateway, 0)).model_dump_json().encode()

    def _head(self, gateway: str) -> JournalHead:
        return self._heads.get(gateway, JournalHead())

    async def _take(self, writer: ProjectionWriter, feed: EnvelopeFeed, timeout_s: float = FEED_TIMEOUT_S) -> int:
        """Store what has come in one transaction, and missing events before it; how many envelopes came."""
        left = list(await feed.next(most=BATCH_ENVELOPES, timeout_s=timeout_s))
        count = len(left)
        batch: list[tuple[Envelope, Sequence[RelayedEvent]]] = []
        done: list[ReceivedEnvelope] = []
        try:
            while left:
                if await self._is_done_with(left[0], writer, batch):
                    done.append(left[0])
                del left[0]
            await self._store_batch(writer, batch)
        except StorageError:
            for one in (*done, *left):
                await one.postpone(RETRY_S)
            raise
        for one in done:
            await one.confirm()
        return count

    async def _is_done_with(
        self,
        received: ReceivedEnvelope,
        writer: ProjectionWriter,
        batch: list[tuple[Envelope, Sequence[RelayedEvent]]],
    ) -> bool:
        """Put an envelope into the batch, or refuse it; False if it was postponed. Raises StorageError."""
        try:
            envelope = Envelope.from_json(received.message)
            events = await self._following(writer, batch, envelope)
        except EnvelopeVersionError as error:
            log.error("an envelope waits for an upgrade", error=error.detail)
            await received.postpone(POSTPONED_S)
            return False
        except InvalidInputError as error:
            log.error("an envelope is refused", error=error.detail)
        except BrokenChainError as error:
            self._refuse(error)
        except (MissingEventsError, GatewayUnreachableError, NoReplyError) as error:
            log.warning("an envelope waits for those before it", error=error.detail)
            await received.postpone(POSTPONED_S)
            return False
        else:
            if events:
                batch.append((envelope, events))
                self._advance(envelope, events)
        return True

    async def _following(
        self, writer: ProjectionWriter, batch: list[tuple[Envelope, Sequence[RelayedEvent]]], envelope: Envelope
    ) -> Sequence[RelayedEvent]:
        """The new events of an envelope; those missing before it are asked of the gateway, and stored first."""
        try:
            return new_events(self._head(envelope.gateway), envelope)
        except MissingEventsError as error:
            log.info("asking a gateway again", error=error.detail)
        await self._store_batch(writer, batch)
        await self._pull(writer, envelope.site, envelope.gateway, envelope.events[-1].seq)
        return new_events(self._head(envelope.gateway), envelope)

    async def _store_batch(
        self, writer: ProjectionWriter, batch: list[tuple[Envelope, Sequence[RelayedEvent]]]
    ) -> None:
        if batch:
            await writer.append(batch)
            self._stored |= {envelope.gateway: events[-1].seq for envelope, events in batch}
            batch.clear()

    async def _pull(self, writer: ProjectionWriter, site: str, gateway: str, up_to: int) -> None:
        """Store a gateway's events from its journal. Raises GatewayUnreachableError, NoReplyError, BrokenChainError."""
        while (after := self._head(gateway).seq) < up_to:
            wanted = EventsWanted(after=after, limit=PAGE_EVENTS)
            message, subject = wanted.model_dump_json().encode(), pages_of(site, gateway)
            reply = await self._bus.request(subject, message, timeout_s=PAGE_TIMEOUT_S)
            envelope = Envelope.from_json(reply)
            events = new_events(self._head(gateway), envelope) if envelope.gateway == gateway else ()
            if not events:
                return
            await self._store_batch(writer, [(envelope, events)])
            self._advance(envelope, events)

    async def _ask_late(self, writer: ProjectionWriter) -> None:
        """Ask gateways that have reported events which nobody published, or which were lost."""
        now_s = self._clock.monotonic()
        for gateway, report in self._reports.items():
            seq = self._head(gateway).seq
            known, since_s = self._late_since_s.get(gateway, (seq, now_s))
            if report.seq <= seq or known != seq:
                self._late_since_s[gateway] = (seq, now_s)
                continue
            self._late_since_s[gateway] = (seq, since_s)
            if now_s - since_s >= LATE_S:
                self._late_since_s[gateway] = (seq, now_s)
                try:
                    await self._pull(writer, report.site, gateway, report.seq)
                except BrokenChainError as error:
                    self._refuse(error)
                except (MissingEventsError, GatewayUnreachableError, NoReplyError, InvalidInputError) as error:
                    log.warning("a gateway's events are late", gateway=gateway, error=error.detail)

    def _advance(self, envelope: Envelope, events: Sequence[RelayedEvent]) -> None:
        self._heads[envelope.gateway] = JournalHead(seq=events[-1].seq, hash=events[-1].hash)
        self.broken.pop(envelope.gateway, None)  # the gateway itself has sent what follows

    def _refuse(self, error: BrokenChainError) -> None:
        log.error("a gateway's events are refused", error=error.detail, hint=error.hint)
        self.broken[str(error.extra["gateway"])] = error.detail
