"""The delivery of one webhook's messages: read from the journal, sent in order, one at a time, until each is taken."""

from __future__ import annotations

import asyncio
import math
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import aclosing
from dataclasses import dataclass
from typing import Final

import structlog

from app.domain.errors import EventsPrunedError, StorageError
from app.domain.events import Event, EventKind
from app.domain.ports.journal import EventReader
from app.domain.ports.stores import PlanStore
from app.domain.webhooks.lifecycle import Lifecycle, may_notify
from app.domain.webhooks.message import Message, job_messages, messages_of
from app.domain.webhooks.webhook import (
    WEBHOOK,
    Progress,
    Reply,
    StoredWebhook,
    Webhook,
    WebhookSender,
    WebhookStore,
    signed_headers,
)
from app.services.clock import Clock
from app.services.journal import SubscriptionClosedError, SubscriptionOverflowError, follow
from app.services.webhooks.views import WebhookSettings

KEPT: Final = 32
PAGE_EVENTS: Final = 50
"""Each event of a run contains the whole run: reading many at once would block the loop."""


@dataclass(slots=True)
class _RunFeed:
    """The lifecycle of a run that a webhook meets while it reads the journal."""

    lifecycle: Lifecycle
    order_id: str | None = None
    order_known: bool = False


class DeliveryFeed:
    """Keeps the newest KEPT runs; one that is met again later, as after a restart, is read anew from its beginning."""

    def __init__(self, journal: EventReader, plans: PlanStore) -> None:
        self._journal = journal
        self._plans = plans
        self._feed: OrderedDict[str, _RunFeed] = OrderedDict()

    async def messages(self, event: Event) -> tuple[Message, ...]:
        """Return the messages of an event; call it in the order of the journal. Raises StorageError."""
        if event.run_id is None or not may_notify(event):
            return job_messages(event)
        # out of the cache meanwhile: after an error halfway it is read anew, and nothing of it is left out
        run_feed = self._feed.pop(event.run_id, None) or await self._read_before(event, event.run_id)
        notifications = run_feed.lifecycle.take(event)
        if notifications and not run_feed.order_known:
            run_feed.order_id, run_feed.order_known = await self._order_id(notifications[0].run.plan_id), True
        self._feed[event.run_id] = run_feed
        if len(self._feed) > KEPT:
            self._feed.popitem(last=False)
        return messages_of(event, notifications, run_feed.order_id)

    async def _read_before(self, event: Event, run_id: str) -> _RunFeed:
        run_feed, after = _RunFeed(Lifecycle()), 0
        while event.kind is not EventKind.RUN_CREATED:
            for earlier in (page := await self._journal.read(after, PAGE_EVENTS, run_id=run_id)):
                if earlier.position >= event.position:
                    return run_feed
                run_feed.lifecycle.take(earlier)
            if not page:
                break
            after = page[-1].position
        return run_feed

    async def _order_id(self, plan_id: str) -> str | None:
        stored = await self._plans.get(plan_id)
        order = None if stored is None else stored.document.get("order")
        found = order.get("id") if isinstance(order, dict) else None
        return found if isinstance(found, str) else None


log = structlog.get_logger(__name__)
GONE = 410


class ReceiverGoneError(Exception):
    """The receiver answered 410: it wants no further messages."""


class HookDelivery:
    """`progress` is the newest state. On disk it is older during a sequence of messages: it is stored each
    `save_each_s`, when nothing is pending, after a failure, and at the end of `run`. Messages since then are repeated
    after a crash.

    Live events wait in a bounded queue while a message is being sent. While a receiver fails nothing waits in memory:
    missed events are read from the journal, page by page, when it works again.
    """

    def __init__(
        self,
        stored: StoredWebhook,
        journal: EventReader,
        feed: DeliveryFeed,
        store: WebhookStore,
        sender: WebhookSender,
        clock: Clock,
        settings: WebhookSettings,
    ) -> None:
        self.hook: Webhook = stored.hook
        self.progress: Progress = stored.progress
        self._secret = stored.secret or ""  # without one nothing is sent: see Webhooks
        self._saved_cursor = stored.progress.cursor
        self._saved_s = -math.inf
        self._unsaved = False
        self._retry_at = clock.monotonic()
        self._journal = journal
        self._feed = feed
        self._store = store
        self._sender = sender
        self._clock = clock
        self._settings = settings

    def change(self, hook: Webhook) -> None:
        """What an administrator has set now, or what the receiver's answer set."""
        self.hook = hook

    def skip_to(self, seq: int) -> None:
        """Nothing up to this event is sent."""
        self.progress = Progress(cursor=seq)

    async def run(self) -> None:
        """Deliver until the journal is closed or this is cancelled. Raises ReceiverGoneError."""
        try:
            await self._deliver()
        finally:
            if self._unsaved:
                await self._save()

    async def send_once(self, message: Message) -> Reply:
        """Send a message now, outside the order, and leave the progress alone."""
        body, now = message.body(), self._clock.now()
        headers = {
            "Content-Type": "application/json",
            **signed_headers(self._secret, message.id, now, body),
            WEBHOOK: self.hook.id,
        }
        return await self._sender.post(self.hook.url, headers, body)

    async def _deliver(self) -> None:
        while True:
            try:
                seq, left = await self._deliver_until_trouble()
                while left:
                    await asyncio.sleep(self._wait_s())
                    left = await self._send_all(left)
                await self._done_with(seq, delivered=True)
            except EventsPrunedError as error:
                log.error("webhook misses events that were deleted by age", webhook=self.hook.id, error=error.detail)
                self.progress = self.progress.moved_to(error.first_seq - 1)
            except SubscriptionOverflowError:
                continue  # the receiver is slower than the events: continue from the disk
            except SubscriptionClosedError:
                return
            except StorageError as error:
                log.error("webhook cannot read the journal", webhook=self.hook.id, error=error.detail)
                await asyncio.sleep(self._settings.disk_again_s)

    async def _deliver_until_trouble(self) -> tuple[int, Sequence[Message]]:
        """The event whose messages were not all taken, and those. What waited in memory is let go."""
        settings, cursor = self._settings, self.progress.cursor
        live = follow(self._journal, cursor, capacity=settings.queue_events, page_events=settings.page_events)
        async with aclosing(live) as events:
            async for event in events:
                messages = [one for one in await self._feed.messages(event) if self.hook.wants(one.type)]
                if left := await self._send_all(messages):
                    return event.position, left
                await self._done_with(event.position, delivered=bool(messages))
        raise SubscriptionClosedError("the journal is closed")

    async def _send_all(self, messages: Sequence[Message]) -> Sequence[Message]:
        """Send one after the other; those from the first one on that was not taken."""
        for number, message in enumerate(messages):
            reply = await self.send_once(message)
            now = self._clock.now()
            if not reply.is_good:
                await self._failed(message, reply, now)
                return messages[number:]
            self.progress = self.progress.delivered(message.id, reply.status or 0, now=now)
        return ()

    async def _failed(self, message: Message, reply: Reply, now: float) -> None:
        gone = reply.status == GONE
        settings = self._settings
        wait_s = settings.backoff.wait_s(
            self.progress.failures + 1, chance=settings.chance(), asked_s=reply.retry_after_s
        )
        problem = reply.problem or _in_words(reply.status)
        self.progress = self.progress.failed(reply.status, problem, now=now, retry_s=None if gone else wait_s)
        self._retry_at = self._clock.monotonic() + wait_s
        log.warning("webhook not delivered", webhook=self.hook.id, message=message.id, problem=problem, gone=gone)
        await self._save()
        if gone:
            raise ReceiverGoneError

    def _wait_s(self) -> float:
        return max(0.0, self._retry_at - self._clock.monotonic())

    async def _done_with(self, seq: int, *, delivered: bool) -> None:
        settings = self._settings
        self.progress = self.progress.moved_to(seq)
        self._unsaved = self._unsaved or delivered or seq - self._saved_cursor >= settings.save_each_events
        is_due = self._clock.monotonic() - self._saved_s >= settings.save_each_s
        if self._unsaved and (is_due or seq >= self._journal.last_seq):
            await self._save()

    async def _save(self) -> None:
        self._saved_s = self._clock.monotonic()
        try:
            await self._store.save_progress(self.hook.id, self.progress)
        except StorageError as error:  # after a crash messages would come again, with the same ids
            log.error("webhook progress not stored", webhook=self.hook.id, error=error.detail)
        else:
            self._saved_cursor, self._unsaved = self.progress.cursor, False


def _in_words(status: int | None) -> str:
    if status is None:
        return "no answer"
    if 300 <= status < 400:
        return f"HTTP {status}: redirects are not followed; give the webhook its final URL"
    return f"HTTP {status}"
