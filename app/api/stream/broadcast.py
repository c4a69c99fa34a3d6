"""Gives every event and every telemetry tick to all sockets, serialised once."""

from __future__ import annotations

import asyncio
from contextlib import aclosing
from typing import Final

import structlog

from app.api.metrics import Metrics
from app.api.stream.frames import event_frame
from app.api.stream.outbox import Outbox, Tick
from app.domain.errors import StorageError
from app.services.clock import Clock
from app.services.fanout import SubscriptionClosedError, SubscriptionOverflowError
from app.services.journal import Journal
from app.services.replay import follow
from app.services.telemetry import TelemetryFeed

SUBSCRIPTION_CAPACITY: Final = 8192
RETRY_S: Final = 1.0
log = structlog.get_logger(__name__)


class Broadcast:
    """One reader of the journal and one of the telemetry for all sockets. It never waits for a socket.

    `last_seq` is the newest event given out. A socket that has seen exactly so far joins with no await between.
    """

    def __init__(self, journal: Journal, telemetry: TelemetryFeed, clock: Clock, metrics: Metrics) -> None:
        self._journal = journal
        self._telemetry = telemetry
        self._clock = clock
        self._metrics = metrics
        self._outboxes: set[Outbox] = set()
        self._tasks: tuple[asyncio.Task[None], ...] = ()
        self.last_seq = 0

    def start(self) -> None:
        """Begin after the journal's newest event."""
        self.last_seq = self._journal.last_seq
        self._tasks = (
            asyncio.create_task(self._send_events(), name="event broadcast"),
            asyncio.create_task(self._send_telemetry(), name="telemetry broadcast"),
        )

    async def close(self) -> None:
        """Stop. Idempotent."""
        for task in self._tasks:
            task.cancel()
        for result in await asyncio.gather(*self._tasks, return_exceptions=True):
            if isinstance(result, Exception):
                log.error("broadcast had failed", exc_info=result)
        self._tasks = ()

    def why_not_ready(self) -> str | None:
        """For /readyz: None while both tasks run."""
        dead = [task.get_name() for task in self._tasks if task.done()]
        return f"stopped: {', '.join(dead)}" if dead or not self._tasks else None

    def join(self, outbox: Outbox) -> None:
        """Give `outbox` all that comes from now on."""
        self._outboxes.add(outbox)

    def leave(self, outbox: Outbox) -> None:
        """End that. Idempotent."""
        self._outboxes.discard(outbox)

    async def _send_events(self) -> None:
        while True:
            try:
                await self._follow()
            except SubscriptionOverflowError:
                log.warning("broadcast fell behind the journal; it reads on from the disk", after=self.last_seq)
            except SubscriptionClosedError:
                return
            except StorageError as error:
                log.error("broadcast cannot read the journal", error=error.detail)
                await asyncio.sleep(RETRY_S)

    async def _follow(self) -> None:
        # events of one commit come here without a break, so that each socket's writer wakes once for all of them
        async with aclosing(follow(self._journal, self.last_seq, capacity=SUBSCRIPTION_CAPACITY)) as events:
            async for event in events:
                frame = event_frame(event)
                for outbox in self._outboxes:
                    outbox.offer_event(event.seq, frame)
                self.last_seq = event.seq
                self._metrics.count_event(event.kind.value)

    async def _send_telemetry(self) -> None:
        subscription = self._telemetry.subscribe()
        try:
            while True:
                states = await subscription.next()
                if not self._outboxes:
                    continue
                tick = Tick(
                    self._clock.now(),
                    {vehicle_id: state.model_dump_json().encode() for vehicle_id, state in states.items()},
                )
                for outbox in self._outboxes:
                    outbox.offer_tick(tick)
        finally:
            subscription.close()
