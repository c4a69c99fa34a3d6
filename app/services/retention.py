"""Retention: what is older than the settings say is deleted, and the journal records what was."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Final

import structlog

from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.errors import StorageError
from app.domain.events.service import JournalPruned
from app.domain.ports.journal import EventJournal
from app.domain.ports.stores import RetentionStore
from app.services.background import background
from app.services.clock import Clock

log = structlog.get_logger(__name__)

FIRST_S: Final = 600.0
"""A machine that starts without the right time gets it meanwhile."""
EVERY_S: Final = 3600.0
DAY_S: Final = 86_400.0


@dataclass(frozen=True, slots=True)
class RetentionPeriods:
    """How long events, with what ended with them, and attached files are kept; None: for ever."""

    events_s: float | None
    attachments_s: float | None

    @classmethod
    def of_days(cls, events: int | None, attachments: int | None) -> RetentionPeriods:
        """As the settings give them: files are kept no longer than their events."""
        periods = [days * DAY_S for days in (events, attachments) if days is not None]
        return cls(None if events is None else events * DAY_S, min(periods, default=None))


class Retention:
    """`relayed` says up to which event a cluster has this journal: what it has not is kept. `plans_in_use` are those
    that were used since the last round: a run or job may be made of one at this moment.

    An event journal.pruned is stored before anything is deleted. If a stop comes in between, the next round goes on.
    """

    def __init__(
        self,
        store: RetentionStore,
        journal: EventJournal,
        clock: Clock,
        periods: RetentionPeriods,
        *,
        plans_in_use: Callable[[], Sequence[str]],
        relayed: Callable[[], Awaitable[int]] | None = None,
    ) -> None:
        self._store = store
        self._journal = journal
        self._clock = clock
        self._periods = periods
        self._plans_in_use = plans_in_use
        self._relayed = relayed

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Delete what is old while the block runs."""
        if self._periods.attachments_s is not None:  # with events always
            periods = {"events_s": self._periods.events_s, "attachments_s": self._periods.attachments_s}
            log.info("retention is on: old data will be deleted", **periods)
        async with background(self._run(), "retention"):
            yield

    async def prune(self) -> None:
        """One round. Raises StorageError."""
        in_use = self._plans_in_use()
        await self._delete(self._journal.pruned, in_use)
        if (pruned := await self._due()) is not None:
            await self._journal.record(self._journal.new_event(pruned))
            await self._delete(pruned, in_use)
            log.info("old data was deleted", up_to=pruned.up_to, attachments_before=pruned.attachments_before)

    async def _run(self) -> None:
        await asyncio.sleep(FIRST_S)
        while True:
            try:
                await self.prune()
            except StorageError as error:
                log.warning("old data is kept until the next round", error=error.detail)
            await asyncio.sleep(EVERY_S)

    async def _due(self) -> JournalPruned | None:
        """What is to be deleted by now; None: nothing."""
        now, last = self._clock.now(), self._journal.pruned
        due = last or JournalPruned(up_to=0, chains=(), before=None, attachments_before=None)
        if self._periods.events_s is not None:
            before = now - self._periods.events_s
            await self._log_what_keeps(before, now)
            if (old := await self._store.prunable(before=before, up_to=await self._most())) is not None:
                chains = {chain.gateway: chain for chain in (*due.chains, *old.chains)}
                changes = {"up_to": old.up_to, "chains": tuple(chains.values()), "before": before}
                due = due.model_copy(update=changes)
        if self._periods.attachments_s is not None:
            before = now - self._periods.attachments_s
            if await self._store.has_attachments(before=before):
                due = due.model_copy(update={"attachments_before": before})
        return None if due == last or due.before is due.attachments_before is None else due

    async def _log_what_keeps(self, before: float, now: float) -> None:
        oldest = await self._store.oldest_open()
        if oldest is not None and oldest[1] < before:
            log.warning("a run or job that is not over keeps old events", id=oldest[0], created_at=oldest[1])
        younger = await self._store.first_younger(before=before)
        if younger is not None and younger[1] > now + DAY_S:
            log.warning("an event with a time in the future keeps old events", position=younger[0], time=younger[1])

    async def _most(self) -> int:
        """Up to which event this journal is not the only one. Files are deleted also if the cluster cannot be asked."""
        if self._relayed is None:
            return self._journal.last_seq
        try:
            return await self._relayed()
        except (BusDownError, GatewayUnreachableError, NoReplyError) as error:
            log.warning("old events are kept until the cluster says which of them it has", error=error.detail)
            return 0

    async def _delete(self, pruned: JournalPruned | None, in_use: Sequence[str]) -> None:
        if pruned is None:
            return
        while await self._store.prune(pruned):
            pass
        while pruned.before is not None and await self._store.delete_plans(before=pruned.before, spared=in_use):
            pass
        if pruned.attachments_before is not None:
            await self._store.delete_attachments(before=pruned.attachments_before)
