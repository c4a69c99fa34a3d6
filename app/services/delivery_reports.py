"""Delivery reports and comparisons of predicted against flown, made from runs, plans and events."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

from app.domain.delivery.comparison import Comparison, compare
from app.domain.delivery.delivery_report import DeliveryReport, RunHistory, report_of
from app.domain.errors import AttachmentAlteredError
from app.domain.events import Event
from app.domain.events.run import RunItemEnded, RunMissionChanged, RunPredicted
from app.domain.ports.journal import EventReader, RunReader
from app.domain.ports.stores import AttachmentStore, PlanStore
from app.domain.prediction import Timeline
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.attachment import PICTURES
from app.services.clock import Clock

PAGE_EVENTS: Final = 100


class Comparisons:
    """Comparisons are computed from the journal on each request."""

    def __init__(self, runs: RunReader, journal: EventReader) -> None:
        self._runs = runs
        self._journal = journal

    async def of(self, run_id: str) -> Comparison:
        """The comparison of one run, of this moment. Raises NotFoundError, StorageError."""
        run = await self._runs.get(run_id)
        compared, after = _ComparedEvents(), 0
        while events := await self._journal.read(after, PAGE_EVENTS, run_id=run.id):
            await asyncio.to_thread(compared.take, events)
            after = events[-1].position
        return await asyncio.to_thread(compare, run, compared.timeline, compared.flown, compared.why_none)


class _ComparedEvents:
    """The events of the run that the comparison needs."""

    def __init__(self) -> None:
        self.timeline: Timeline | None = None
        self.flown: list[RunItemEnded] = []

    @property
    def why_none(self) -> Reason | None:
        return Reason.of(ReasonCode.RUN_NOT_PREDICTED) if self.timeline is None else None

    def take(self, events: Sequence[Event]) -> None:
        for event in events:
            if isinstance(event.data, RunPredicted):
                self.timeline = event.data.root
            elif isinstance(event.data, RunMissionChanged):
                self._take_change(event.data.timeline)
            elif isinstance(event.data, RunItemEnded):
                self.flown.append(event.data)

    def _take_change(self, rest: Timeline) -> None:
        """The plan was changed in flight: each part is compared with its own prediction."""
        visits: Counter[str] = Counter()
        flown: set[tuple[str, int]] = set()
        for ended in self.flown:
            visits[ended.item_id] += 1
            flown.add((ended.item_id, visits[ended.item_id]))
        if self.timeline is not None:
            self.timeline = self.timeline.continued(flown, rest)


PICTURE_BYTES: Final = 300_000
SHEET_PICTURES_BYTES: Final = 3_000_000
"""Larger pictures are listed by name and hash: a sheet is sent by mail and kept for years."""


@dataclass(frozen=True, slots=True)
class IssuedReport:
    """A delivery report, and the document of the plan that it is about: empty if the plan is gone from the disk."""

    report: DeliveryReport
    plan: dict[str, Any]

    @property
    def small_pictures(self) -> Iterator[str]:
        """The hashes of the pictures to include, as many as a report can hold."""
        room = SHEET_PICTURES_BYTES
        for one in self.report.attachments:
            if one.media_type in PICTURES and one.is_as_attached and one.size_bytes <= min(PICTURE_BYTES, room):
                room -= one.size_bytes
                yield one.sha256


class DeliveryReports:
    """Delivery reports are computed from the stored data on each request."""

    def __init__(
        self,
        runs: RunReader,
        plans: PlanStore,
        attachments: AttachmentStore,
        journal: EventReader,
        clock: Clock,
        gateway_id: str,
    ) -> None:
        self._runs = runs
        self._plans = plans
        self._attachments = attachments
        self._journal = journal
        self._clock = clock
        self._gateway_id = gateway_id

    async def of(self, run_id: str) -> IssuedReport:
        """The delivery report of one run, of this moment. Raises NotFoundError, StorageError."""
        run = await self._runs.get(run_id)
        stored = await self._plans.get(run.plan_id)
        document = {} if stored is None else stored.document
        history, after = RunHistory(), 0
        while events := await self._journal.read(after, PAGE_EVENTS, run_id=run.id):
            await asyncio.to_thread(_take_all, history, events)
            after = events[-1].position
        hashes = {attachment.sha256 for attachment in history.attachments}
        altered = {sha256 for sha256 in hashes if not await self._attachments.is_intact(sha256)}
        report = await asyncio.to_thread(
            report_of,
            run,
            history,
            gateway=self._gateway_id,
            document=document,
            altered=altered,
            issued_at=self._clock.now(),
            attachments_before=None if self._journal.pruned is None else self._journal.pruned.attachments_before,
        )
        return IssuedReport(report, document)

    async def pictures(self, issued: IssuedReport) -> dict[str, bytes]:
        """The small pictures of a delivery report by their SHA-256, for its sheet. Raises StorageError."""
        found = {}
        for sha256 in issued.small_pictures:
            with suppress(AttachmentAlteredError):  # since it was issued: the page then has its name and hash alone
                found[sha256] = await self._attachments.get(sha256)
        return found


def _take_all(history: RunHistory, events: Sequence[Event]) -> None:
    for event in events:
        history.take(event)
