"""The projection: gateways' events into the cluster's store, each once, with its chain verified.

JetStream may lose messages that it has acknowledged. What is missing is asked of the gateway, whose journal has it.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
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
from app.domain.cluster.errors import BusDownError
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
from app.domain.errors import InvalidInputError, StorageError, WaydropError
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
MOST_PAGES: Final = 10
"""Of one gateway, before what it has answered is stored."""
ASKED_AT_ONCE: Final = 8
"""Gateways."""
LONGEST_PAUSE_S: Final = 60.0
"""A gateway that does not answer is asked again after LATE_S, then after twice as long each time, up to this."""
SILENT_S: Final = 10.0
"""A gateway that has not reported for so long is not asked because of its last report."""


@dataclass(slots=True)
class _Gateway:
    """What it has reported, up to event `up_to`. `since_s`: `seq` has been its newest event in the store since then.

    `is_missing`: an envelope came, but not those before it; or it has more than it could answer at once.
    """

    site: str
    up_to: int = 0
    heard_s: float = -math.inf
    seq: int = -1
    since_s: float = -math.inf
    is_missing: bool = False
    failures: int = 0
    not_before_s: float = -math.inf
    asking: asyncio.Task[Sequence[Envelope]] | None = None

    def is_late(self, seq: int, now_s: float) -> bool:
        """Whether to ask it now for events after `seq`, the newest one in the store."""
        if self.up_to <= seq:
            self.is_missing = False
        if self.up_to <= seq or self.seq != seq:
            self.seq, self.since_s = seq, now_s
        if self.up_to <= seq or self.asking is not None or now_s < self.not_before_s:
            return False
        return self.is_missing or (not self.is_silent(now_s) and now_s - self.since_s >= LATE_S)

    def is_silent(self, now_s: float) -> bool:
        return now_s - self.heard_s > SILENT_S

    def pause(self, now_s: float) -> None:
        """It did not answer, or nothing new."""
        self.not_before_s = now_s + min(LATE_S * 2**self.failures, LONGEST_PAUSE_S)
        self.failures = min(self.failures + 1, 10)

    def end_pause(self) -> None:
        self.failures, self.not_before_s = 0, -math.inf


class LateGateways:
    """Asks gateways for the events that have not come, in tasks beside the feed: one that is dead delays no other."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus = bus
        self._clock = clock
        self._gateways: dict[str, _Gateway] = {}

    async def close(self) -> None:
        """Ask no further. Idempotent."""
        await end_tasks(*(gateway.asking for gateway in self._gateways.values()))

    @property
    def are_asked(self) -> bool:
        """Whether an answer may come."""
        return any(gateway.asking is not None for gateway in self._gateways.values())

    def hear(self, report: GatewayReport) -> None:
        """Take a report: its events may be late."""
        gateway, now_s = self._gateways.setdefault(report.gateway, _Gateway(report.site)), self._clock.monotonic()
        if gateway.is_silent(now_s):
            gateway.end_pause()
        gateway.site, gateway.up_to, gateway.heard_s = report.site, report.seq, now_s

    def miss(self, envelope: Envelope) -> None:
        """Events before this envelope have not come."""
        gateway = self._gateways.setdefault(envelope.gateway, _Gateway(envelope.site))
        gateway.up_to, gateway.is_missing = max(gateway.up_to, envelope.events[-1].seq), True

    def ask(self, newest: Callable[[str], int]) -> None:
        """Begin to ask those that are late. `newest`: the newest event in the store, by gateway."""
        now_s = self._clock.monotonic()
        asked = sum(gateway.asking is not None for gateway in self._gateways.values())
        for name, gateway in tuple(self._gateways.items()):
            seq = newest(name)
            if gateway.is_late(seq, now_s) and asked < ASKED_AT_ONCE:
                asked += 1
                pages = self._pages(gateway.site, name, seq, gateway.up_to)
                gateway.asking = asyncio.create_task(pages, name=f"events of {name}")
            elif gateway.asking is None and not gateway.is_missing and gateway.is_silent(now_s):
                del self._gateways[name]

    def answered(self) -> Sequence[tuple[str, Sequence[Envelope]]]:
        """What has been answered since, by gateway; to be followed by `took`."""
        found: list[tuple[str, Sequence[Envelope]]] = []
        for name, gateway in self._gateways.items():
            if gateway.asking is None or not gateway.asking.done():
                continue
            task, gateway.asking = gateway.asking, None
            try:
                found.append((name, task.result()))
            except WaydropError as error:
                log.warning("a gateway's events are late", gateway=name, error=error.detail)
                gateway.pause(self._clock.monotonic())
        return found

    def took(self, name: str, *, has_new: bool) -> None:
        """Whether there were new events in the answer: then the rest is asked for at once."""
        gateway = self._gateways[name]
        if has_new:
            gateway.is_missing = True
            gateway.end_pause()
        else:
            gateway.pause(self._clock.monotonic())

    async def _pages(self, site: str, name: str, after: int, up_to: int) -> Sequence[Envelope]:
        """A gateway's events from its journal. Raises GatewayUnreachableError, NoReplyError, InvalidInputError."""
        pages: list[Envelope] = []
        while after < up_to and len(pages) < MOST_PAGES:
            wanted = EventsWanted(after=after, limit=PAGE_EVENTS).model_dump_json().encode()
            try:
                reply = await self._bus.request(pages_of(site, name), wanted, timeout_s=PAGE_TIMEOUT_S)
            except WaydropError:
                if pages:
                    break
                raise
            envelope = Envelope.from_json(reply)
            if envelope.gateway != name or not envelope.events or envelope.events[-1].seq <= after:
                break
            pages.append(envelope)
            after = envelope.events[-1].seq
        return pages


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
        self._late = LateGateways(bus, clock)
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
        self._late.hear(report)

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
        self._late, self.broken = LateGateways(self._bus, self._clock), {}
        try:
            async with (
                self._bus.envelopes() as feed,
                self._bus.answering(CURSORS, self._cursor, in_queue_group=True),
            ):
                began_s = self._clock.monotonic()
                while await self._take(writer, feed, WAITING_TIMEOUT_S) or self._late.are_asked:
                    await self._take_late(writer)
                    if self._clock.monotonic() - began_s >= WAITED_S:
                        break
                async with self._also(writer):
                    while True:
                        await self._take(writer, feed, WAITING_TIMEOUT_S if self._late.are_asked else FEED_TIMEOUT_S)
                        await self._take_late(writer)
                        await self._check(writer)
        finally:
            await self._late.close()

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

    async def _take(self, writer: ProjectionWriter, feed: EnvelopeFeed, timeout_s: float) -> int:
        """Store what has come in one transaction; how many envelopes came."""
        left = list(await feed.next(most=BATCH_ENVELOPES, timeout_s=timeout_s))
        count = len(left)
        batch: list[tuple[Envelope, Sequence[RelayedEvent]]] = []
        done: list[ReceivedEnvelope] = []
        try:
            while left:
                if await self._is_done_with(left[0], batch):
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
        self, received: ReceivedEnvelope, batch: list[tuple[Envelope, Sequence[RelayedEvent]]]
    ) -> bool:
        """Put an envelope into the batch, or refuse it; False if it was postponed."""
        try:
            envelope = Envelope.from_json(received.message)
            events = self._following(envelope)
        except EnvelopeVersionError as error:
            log.error("an envelope waits for an upgrade", error=error.detail)
            await received.postpone(POSTPONED_S)
            return False
        except InvalidInputError as error:
            log.error("an envelope is refused", error=error.detail)
        except BrokenChainError as error:
            self._refuse(error)
        except MissingEventsError as error:
            log.info("an envelope waits for those before it", error=error.detail)
            await received.postpone(POSTPONED_S)
            return False
        else:
            if events:
                batch.append((envelope, events))
                self._advance(envelope, events)
        return True

    def _following(self, envelope: Envelope) -> Sequence[RelayedEvent]:
        """The new events of an envelope. If some before it are missing, the gateway is asked for all up to its end."""
        try:
            return new_events(self._head(envelope.gateway), envelope)
        except MissingEventsError:
            self._late.miss(envelope)
            raise

    async def _store_batch(
        self, writer: ProjectionWriter, batch: list[tuple[Envelope, Sequence[RelayedEvent]]]
    ) -> None:
        if batch:
            await writer.append(batch)
            self._stored |= {envelope.gateway: events[-1].seq for envelope, events in batch}
            batch.clear()

    async def _take_late(self, writer: ProjectionWriter) -> None:
        """Store what gateways have answered, and ask those that are late by now. Raises StorageError."""
        await asyncio.sleep(0)  # they must get their turn, however much comes
        for gateway, pages in self._late.answered():
            batch: list[tuple[Envelope, Sequence[RelayedEvent]]] = []
            try:
                for envelope in pages:
                    if events := new_events(self._head(gateway), envelope):
                        batch.append((envelope, events))
                        self._advance(envelope, events)
            except BrokenChainError as error:
                self._refuse(error)
            except MissingEventsError as error:
                log.warning("a gateway's events are late", gateway=gateway, error=error.detail)
            self._late.took(gateway, has_new=bool(batch))
            await self._store_batch(writer, batch)
        self._late.ask(lambda gateway: self._head(gateway).seq)

    def _advance(self, envelope: Envelope, events: Sequence[RelayedEvent]) -> None:
        self._heads[envelope.gateway] = JournalHead(seq=events[-1].seq, hash=events[-1].hash)
        self.broken.pop(envelope.gateway, None)  # the gateway itself has sent what follows

    def _refuse(self, error: BrokenChainError) -> None:
        log.error("a gateway's events are refused", error=error.detail, hint=error.hint)
        self.broken[str(error.extra["gateway"])] = error.detail
