"""How far a webhook has come is stored seldom while messages follow each other, and always when they stop."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager, suppress

import pytest

from app.domain.events import Event, EventKind, NewEvent
from app.domain.events.run import RunCreated
from app.domain.events.service import JournalPruned
from app.domain.webhooks.webhook import Progress, Reply, StoredWebhook, Webhook
from app.services.journal import Journal
from app.services.webhooks import Webhooks
from app.services.webhooks.delivery import DeliveryFeed, HookDelivery, ReceiverGoneError
from app.services.webhooks.views import WebhookRequest, WebhookSettings, WebhookUpdate
from tests.support.delivery_feed import Plans
from tests.support.events import data_of
from tests.support.fakes import ManualClock, MemoryEventStore
from tests.support.run_events import RunEvents, new_run

SETTINGS = WebhookSettings()
MESSAGES = 300
LIMIT_S = 30.0


class Receiver:
    """WebhookSender. Each message takes `takes_s`; from number `until` on it answers `then`, None: never."""

    def __init__(self, clock: ManualClock, *, takes_s: float = 0.0, until: int = MESSAGES, then: int | None = 200):
        self.taken = 0
        self._clock, self._takes_s, self._until, self._then = clock, takes_s, until, then
        self.reached = asyncio.Event()

    async def post(self, url: str, headers: Mapping[str, str], body: bytes) -> Reply:
        """See WebhookSender."""
        self._clock.time_s += self._takes_s
        if self.taken < self._until:
            self.taken += 1
            return Reply(200)
        self.reached.set()
        if self._then is None:
            await asyncio.Event().wait()
        return Reply(self._then)


class Disk:
    """WebhookStore that keeps what was stored, one after the other, and how many were taken by then."""

    def __init__(self) -> None:
        self.stored: list[Progress] = []
        self.changed = asyncio.Event()
        self.is_asked = asyncio.Event()
        self.open = asyncio.Event()
        self.open.set()

    async def save_progress(self, hook_id: str, progress: Progress) -> None:
        """See WebhookStore."""
        self.stored.append(progress)
        self.changed.set()

    async def add(self, stored: StoredWebhook) -> None:
        """See WebhookStore."""

    async def list_webhooks(self) -> Sequence[StoredWebhook]:
        """See WebhookStore."""
        return ()

    async def change(self, hook: Webhook) -> None:
        """See WebhookStore."""
        self.is_asked.set()
        await self.open.wait()

    async def delete(self, hook_id: str) -> None:
        """See WebhookStore."""

    async def until_cursor(self, cursor: int) -> None:
        """Wait until this cursor is stored."""
        async with asyncio.timeout(LIMIT_S):
            while not self.stored or self.stored[-1].cursor < cursor:
                self.changed.clear()
                await self.changed.wait()


def one_message_each() -> list[Event]:
    """As many runs that were ordered: each event is one message."""
    run_events = RunEvents(new_run())
    events = []
    for number in range(MESSAGES):
        run_events.run = new_run().model_copy(update={"id": f"r{number}"})
        events.append(run_events.event(RunCreated(run_events.run)))
    return events


@asynccontextmanager
async def delivering(
    clock: ManualClock, receiver: Receiver, disk: Disk, *, cursor: int = 0, pruned: int | None = None
) -> AsyncIterator[asyncio.Task[None]]:
    """A webhook that catches up with all messages after `cursor`. Events up to `pruned` were deleted by age."""
    events = MemoryEventStore()
    events.events += one_message_each()
    if pruned is not None:
        told = JournalPruned(up_to=pruned, chains=(), before=1.0, attachments_before=None)
        await events.append([NewEvent.of(told, 1.0)])
    journal = Journal(events, clock)
    await journal.start()
    hook = Webhook(id="hook-1", url="https://receiver.example/", created_at=1.0, created_by="desk")
    stored = StoredWebhook(hook, "whsec_eA==", Progress(cursor=cursor))
    task = asyncio.create_task(
        HookDelivery(stored, journal, DeliveryFeed(journal, Plans()), disk, receiver, clock, SETTINGS).run()
    )
    try:
        yield task
    finally:
        task.cancel()
        await asyncio.wait({task})
        await journal.close()


async def test_a_burst_is_noted_at_its_beginning_and_its_end() -> None:
    clock, disk = ManualClock(), Disk()
    async with delivering(clock, Receiver(clock), disk):
        await disk.until_cursor(MESSAGES)
    assert [one.cursor for one in disk.stored] == [1, MESSAGES]


async def test_a_long_catching_up_is_noted_as_often_as_is_set_and_no_more() -> None:
    clock, disk = ManualClock(), Disk()
    each = 16
    async with delivering(clock, Receiver(clock, takes_s=SETTINGS.save_each_s / each), disk):
        await disk.until_cursor(MESSAGES)
    cursors = [one.cursor for one in disk.stored]
    assert cursors == [*range(1, MESSAGES, each), MESSAGES]


async def test_a_slow_receiver_has_each_message_noted() -> None:
    clock, disk = ManualClock(), Disk()
    async with delivering(clock, Receiver(clock, takes_s=SETTINGS.save_each_s), disk):
        await disk.until_cursor(MESSAGES)
    assert [one.cursor for one in disk.stored] == list(range(1, MESSAGES + 1))


async def test_stopped_on_the_way_it_notes_all_that_was_taken() -> None:
    clock, disk = ManualClock(), Disk()
    receiver = Receiver(clock, until=7, then=None)
    async with delivering(clock, receiver, disk), asyncio.timeout(LIMIT_S):
        await receiver.reached.wait()
    assert [one.cursor for one in disk.stored] == [1, 7]


@pytest.mark.parametrize("status", [500, 410])
async def test_a_failure_notes_all_that_was_taken_before(status: int) -> None:
    clock, disk = ManualClock(), Disk()
    async with delivering(clock, Receiver(clock, until=7, then=status), disk) as task:
        await disk.until_cursor(7)
        if status == 410:
            with pytest.raises(ReceiverGoneError):
                await task
    with suppress(asyncio.CancelledError, ReceiverGoneError):
        await task
    assert [(one.cursor, one.failures) for one in disk.stored] == [(1, 0), (7, 1)]


async def test_after_events_were_deleted_by_age_it_goes_on_with_the_oldest_that_is_kept() -> None:
    clock, disk = ManualClock(), Disk()
    receiver = Receiver(clock)
    async with delivering(clock, receiver, disk, cursor=50, pruned=100):
        await disk.until_cursor(MESSAGES + 1)
    assert receiver.taken == MESSAGES - 100


async def test_what_a_receiver_changes_is_told_before_what_an_administrator_changes_after_it() -> None:
    clock, disk, events = ManualClock(), Disk(), MemoryEventStore()
    journal = Journal(events, clock)
    await journal.start()
    hooks = Webhooks(disk, Plans(), journal, Receiver(clock, until=0, then=410), clock, "gw-1", SETTINGS)
    try:
        view, _ = await hooks.create(WebhookRequest(url="https://receiver.example/"), actor="desk")
        disk.open.clear()
        await journal.record(journal.new_event(RunCreated(new_run()), vehicle_id="v1", run_id="r1"))
        async with asyncio.timeout(LIMIT_S):
            await disk.is_asked.wait()
            enabling = asyncio.create_task(
                hooks.change(view.webhook.id, WebhookUpdate(enabled=True, description="again"), actor="desk")
            )
            await asyncio.sleep(0)
            disk.open.set()
            await enabling
    finally:
        disk.open.set()
        await hooks.close()
        await journal.close()
    told = [data_of(one)["change"] for one in events.events if one.kind is EventKind.WEBHOOK_CHANGED]
    assert told[:3] == ["created", "disabled", "enabled"]
