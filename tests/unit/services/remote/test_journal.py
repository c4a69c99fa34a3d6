"""The journal of an API node: what the store has, this node may tell a moment later."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Sequence

from app.domain.events import Event
from app.services.remote.journal import ClusterJournal
from tests.support.fakes import ManualClock
from tests.support.memory_cluster import MemoryClusterEvents
from tests.support.stored_samples import event


class LateEvents(MemoryClusterEvents):
    """A store that tells of new events when it is let."""

    def __init__(self) -> None:
        super().__init__()
        self.told = asyncio.Event()

    async def pages(self, after: int, limit: int) -> AsyncGenerator[Sequence[Event], None]:
        """See ClusterChanges."""
        await self.told.wait()
        async for page in super().pages(after, limit):
            yield page


async def test_a_position_that_another_node_has_told_is_waited_for_and_one_that_nobody_has_is_not() -> None:
    events = LateEvents()
    journal = ClusterJournal(events, ManualClock())
    await journal.start()
    try:
        await events.append([event(1)])
        assert not await journal.has(2), "nobody can have told of it"
        assert await journal.has(0)
        waiting = asyncio.create_task(journal.has(1))
        await asyncio.sleep(0)
        assert journal.last_seq == 0
        events.told.set()
        assert await waiting, "a client that has it from another node misses nothing here"
        assert journal.last_seq == 1
    finally:
        await journal.close()
