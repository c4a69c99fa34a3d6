"""A journal of a hundred days, in which each kind of thing became old."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from app.domain.events import AnyPayload, NewEvent
from app.domain.events.run import RunAttachment, RunChanged, RunCreated, RunDrop
from app.domain.events.service import JobChanged
from app.domain.jobs.job import Job, JobState
from app.domain.plan.document import document_hash
from app.domain.ports.stores import EventStore, StoredPlan
from app.domain.run.attachment import Attachment
from app.domain.run.run import Run, RunState
from tests.support.job_examples import a_job
from tests.support.stored_samples import event, plan, run
from tests.support.verified_journal import DOCUMENT, announced

DAY_S: Final = 86_400.0
TODAY_S: Final = 100 * DAY_S


class History:
    """Stores things as they happened on a day. What `days` says is between 0 and 100."""

    def __init__(self, store: EventStore) -> None:
        self._store = store

    async def plan(self, number: int, day: float) -> StoredPlan:
        """A plan is posted."""
        posted = replace(
            plan(number),
            name=str(DOCUMENT["name"]),
            hash=document_hash(DOCUMENT),
            document=DOCUMENT,
            created_at=day * DAY_S,
        )
        await self._store.append([at(day, announced(posted))], plans=[posted])
        return posted

    async def run(self, number: int, of: StoredPlan, day: float, ended: float | None = None) -> Run:
        """A run is created, and ends on another day or not at all."""
        created = run(number, plan_id=of.id).model_copy(update={"plan_hash": of.hash, "created_at": day * DAY_S})
        await self._store.append([at(day, RunCreated(created), created.id)], [created])
        return created if ended is None else await self.end(created, ended)

    async def end(self, flown: Run, day: float) -> Run:
        """A drop, and the end of the run."""
        drop = flown.drops[0].model_copy(update={"reason": None})
        over = flown.model_copy(update={"state": RunState.COMPLETED, "ended_at": day * DAY_S})
        await self._store.append([at(day, RunDrop(drop), flown.id)], [flown])
        await self._store.append([at(day, RunChanged(over), flown.id)], [over])
        return over

    async def job(self, number: int, of: StoredPlan, day: float, ended: float | None = None) -> Job:
        """A job is queued, and cancelled on another day or not at all."""
        queued = a_job(number, plan_id=of.id, plan_hash=of.hash, created_at=day * DAY_S)
        await self._store.append([at(day, JobChanged(change="queued", actor="ward 3", job=queued))], jobs=[queued])
        if ended is None:
            return queued
        over = queued.model_copy(update={"state": JobState.CANCELLED, "ended_at": ended * DAY_S})
        await self._store.append([at(ended, JobChanged(change="ended", actor="ward 3", job=over))], jobs=[over])
        return over

    async def attach(self, to: Run, sha256: str, day: float) -> None:
        """A file is attached to the drop of a run."""
        payload = RunAttachment(
            Attachment(
                plan_item_id="drop-1",
                name="door.jpg",
                media_type="image/jpeg",
                size_bytes=4,
                sha256=sha256,
                at=day * DAY_S,
                actor="ward 3",
            )
        )
        await self._store.append([at(day, payload, to.id)])

    async def items(self, day: float, count: int = 1) -> None:
        """Something else happens."""
        await self._store.append([event(n)._replace(time=day * DAY_S) for n in range(count)])


def at(day: float, payload: AnyPayload, run_id: str | None = None) -> NewEvent:
    """An event of a day."""
    return NewEvent.of(payload, day * DAY_S, run_id=run_id)


def ids(of: Sequence[Run | Job | StoredPlan]) -> list[str]:
    """Their ids, sorted."""
    return sorted(one.id for one in of)
