"""The ports to the journal and the runs: a gateway's own, or a cluster's as an API node sees them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from app.domain.events import AnyPayload, Event, NewEvent
from app.domain.events.service import JournalPruned
from app.domain.ports.stores import ALL_RUNS, JobRecord, RunFilter, StoredAnswer, StoredPlan
from app.domain.run.run import Run, RunState


class EventFeed(Protocol):
    """The events after `after`, in order."""

    after: int

    async def get(self) -> Event:
        """The next event; waits for it. Raises SubscriptionClosedError, SubscriptionOverflowError."""

    def close(self) -> None:
        """End it. Idempotent."""


class EventReader(Protocol):
    """Events by their position: a gateway's own number, or the cluster's."""

    @property
    def last_seq(self) -> int:
        """The position of the newest event; 0 before the first."""

    @property
    def pruned(self) -> JournalPruned | None:
        """What was deleted from it by age; None if nothing was."""

    @property
    def healthy(self) -> bool:
        """Whether the last write succeeded, or, of a cluster's events, their last read: if not, nothing may be started
        that must be recorded.
        """

    async def read(self, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """Events with position > after, in order, at most `limit`. Raises StorageError."""

    async def has(self, position: int) -> bool:
        """Whether there is an event at this position, or it is 0. One that is stored is read before this returns.

        Raises StorageError.
        """

    def subscribe(self, capacity: int) -> EventFeed:
        """All events after `last_seq`, as they come; cut off for being slow beyond `capacity`."""


class EventJournal(EventReader, Protocol):
    """The same, and what happens here is recorded in it."""

    def new_event(self, payload: AnyPayload, *, vehicle_id: str | None = None, run_id: str | None = None) -> NewEvent:
        """An event that happens now."""

    async def record(
        self,
        *events: NewEvent,
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """Store events with their runs, plans, jobs and answers, together or not at all. Raises StorageError."""


class AuditedJournal(EventJournal, Protocol):
    """The same, with the audit's own events at hand."""

    async def newest_accepted(self, before: int | None, limit: int) -> Sequence[Event]:
        """Events of the kind request.accepted with position < `before`, newest first. Raises StorageError."""


class RunReader(Protocol):
    """Runs, wherever they fly."""

    async def get(self, run_id: str) -> Run:
        """One run. Raises NotFoundError, StorageError."""

    async def list_runs(self, limit: int, wanted: RunFilter = ALL_RUNS) -> Sequence[Run]:
        """Newest first. Raises NotFoundError if `wanted.older_than` is no run, StorageError."""

    def open_states(self) -> Mapping[RunState, int]:
        """How many runs have not ended, by state."""
