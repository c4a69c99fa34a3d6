"""The lifecycles of the runs that a webhook meets while it reads the journal."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from app.domain.events import Event, EventKind
from app.domain.ports import PlanStore
from app.domain.webhooks.job_news import job_messages
from app.domain.webhooks.lifecycle import Lifecycle, may_be_news
from app.domain.webhooks.message import Message, messages_of
from app.services.journal import Journal

KEPT: Final = 32
PAGE_EVENTS: Final = 50
"""A run's events hold the whole run each: reading many at once would hold up the loop."""


@dataclass(slots=True)
class _Story:
    lifecycle: Lifecycle
    order_id: str | None = None
    order_known: bool = False


class Stories:
    """Keeps the newest KEPT runs; one that is met again later, as after a restart, is read anew from its beginning."""

    def __init__(self, journal: Journal, plans: PlanStore) -> None:
        self._journal = journal
        self._plans = plans
        self._stories: OrderedDict[str, _Story] = OrderedDict()

    async def messages(self, event: Event) -> tuple[Message, ...]:
        """What is to be told of an event; asked in the order of the journal. Raises StorageError."""
        if event.run_id is None or not may_be_news(event):
            return job_messages(event)
        # out of the cache meanwhile: after an error halfway it is read anew, and nothing of it is left out
        story = self._stories.pop(event.run_id, None) or await self._read_before(event, event.run_id)
        news = story.lifecycle.take(event)
        if news and not story.order_known:
            story.order_id, story.order_known = await self._order_id(news[0].run.plan_id), True
        self._stories[event.run_id] = story
        if len(self._stories) > KEPT:
            self._stories.popitem(last=False)
        return messages_of(event, news, story.order_id)

    async def _read_before(self, event: Event, run_id: str) -> _Story:
        story, after = _Story(Lifecycle()), 0
        while event.kind is not EventKind.RUN_CREATED:
            for earlier in (page := await self._journal.read(after, PAGE_EVENTS, run_id=run_id)):
                if earlier.seq >= event.seq:
                    return story
                story.lifecycle.take(earlier)
            if not page:
                break
            after = page[-1].seq
        return story

    async def _order_id(self, plan_id: str) -> str | None:
        stored = await self._plans.get(plan_id)
        order = None if stored is None else stored.document.get("order")
        found = order.get("id") if isinstance(order, dict) else None
        return found if isinstance(found, str) else None
