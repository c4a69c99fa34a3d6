"""The lifecycle of a delivery as other systems follow it: derived from one run's events, each step once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.drop.consent import ConsentState
from app.domain.drop.record import Certainty, DropOutcome, DropRecord
from app.domain.events import Event, EventKind
from app.domain.events.run import RunAttachment
from app.domain.events.run_fold import RunFold
from app.domain.run.attachment import Attachment
from app.domain.run.run import Run, RunState


class DeliveryEvent(StrEnum):
    """The types of webhook messages. docs/how-to/receive-webhooks.md has the table."""

    CREATED = "delivery.created"
    """A run was ordered: its mission goes to the vehicle."""
    READY = "delivery.ready"
    """The mission is on the vehicle and verified. Again after a start that failed on the ground, with the reason."""
    DEPARTED = "delivery.departed"
    """The vehicle took off; again after each landing on the way."""
    ARRIVED = "delivery.arrived"
    """The vehicle is at a supervised drop."""
    PAUSED = "delivery.paused"
    """The vehicle holds its position until it is resumed."""
    RESUMED = "delivery.resumed"
    """It flies its mission on."""
    RETURNING = "delivery.returning"
    """The vehicle returns before the end of its mission."""
    LANDED = "delivery.landed"
    """It landed; the run has not ended yet."""
    COMPLETED = "delivery.completed"
    """The run completed. Each drop says whether its parcel was released."""
    ABORTED = "delivery.aborted"
    """The run was ended before its time."""
    FAILED = "delivery.failed"
    """The run ended by a failure: `reason`."""
    LOST = "delivery.lost"
    """The vehicle is no longer observed."""
    DROP_CONSENT_ASKED = "drop.consent_asked"
    """The vehicle holds at a drop and waits for a person's yes, until `drop.consent.deadline_at`."""
    DROP_RELEASED = "drop.released"
    """A drop ended with the parcel released; `drop.certainty` says how sure that is."""
    DROP_KEPT = "drop.kept"
    """A drop ended with the parcel on board."""
    DROP_UNKNOWN = "drop.unknown"
    """A drop ended with an unknown outcome: `drop.reason`."""
    DROP_ATTACHMENT = "drop.attachment"
    """A photo, signature or document was attached to a drop."""
    JOB_QUEUED = "job.queued"
    """A job was ordered. Messages of jobs have `job` and no `run`."""
    JOB_ASSIGNED = "job.assigned"
    """A vehicle was chosen: `job.vehicle_id`; its run is `job.run_id`."""
    JOB_REQUEUED = "job.requeued"
    """It waits again: its vehicle was taken meanwhile, or a restart broke the preparation off."""
    JOB_COMPLETED = "job.completed"
    """Its run completed, and every drop was released."""
    JOB_FAILED = "job.failed"
    """Its run ended otherwise: `job.reason`. The vehicle's queue is stopped."""
    JOB_CANCELLED = "job.cancelled"
    """It was cancelled before it flew."""
    JOB_EXPIRED = "job.expired"
    """It was not started by its deadline; `job.candidates` say why no vehicle could."""
    QUEUE_STOPPED = "queue.stopped"
    """The queue of a vehicle is stopped until an operator resumes it: `queue.reason`."""
    QUEUE_RESUMED = "queue.resumed"
    """The queue is resumed."""
    TEST = "webhook.test"
    """Sent when an administrator asks for it; about no run. Every webhook gets it."""


_S = RunState
_BY_STATE: Final = {
    _S.CREATED: DeliveryEvent.CREATED,
    _S.UPLOADED: DeliveryEvent.READY,
    _S.AT_DROP: DeliveryEvent.ARRIVED,
    _S.PAUSED: DeliveryEvent.PAUSED,
    _S.RETURNING: DeliveryEvent.RETURNING,
    _S.LANDED: DeliveryEvent.LANDED,
    _S.COMPLETED: DeliveryEvent.COMPLETED,
    _S.ABORTED: DeliveryEvent.ABORTED,
    _S.FAILED: DeliveryEvent.FAILED,
    _S.LOST: DeliveryEvent.LOST,
}
_BY_OUTCOME: Final = {
    DropOutcome.RELEASED: DeliveryEvent.DROP_RELEASED,
    DropOutcome.KEPT: DeliveryEvent.DROP_KEPT,
    DropOutcome.UNKNOWN: DeliveryEvent.DROP_UNKNOWN,
}
_KINDS: Final = frozenset({EventKind.RUN_CREATED, EventKind.RUN_CHANGED, EventKind.RUN_DROP, EventKind.RUN_ATTACHMENT})


def may_notify(event: Event) -> bool:
    """Whether an event can be part of a lifecycle at all: most cannot, and need not be looked at."""
    return event.run_id is not None and event.kind in _KINDS


@dataclass(frozen=True, slots=True)
class Notification:
    """One notification about a run, with the run at that time."""

    type: DeliveryEvent
    run: Run
    drop: DropRecord | None = None
    attachment: Attachment | None = None


class Lifecycle:
    """Takes the events of one run in order and derives the notifications of each.

    The same events give the same notifications, so a restart begins with the first event of the run.
    """

    def __init__(self) -> None:
        self._fold = RunFold()
        self._state: RunState | None = None
        self._drops: dict[str, tuple[DropOutcome, Certainty]] = {}
        self._questions: dict[str, int] = {}

    def take(self, event: Event) -> tuple[Notification, ...]:
        """Return the notifications of this event; most have none."""
        if not may_notify(event):
            return ()
        self._fold.take(event.data)
        run = self._fold.run()
        if run is None:
            return ()
        if isinstance(event.data, RunAttachment):
            return (Notification(DeliveryEvent.DROP_ATTACHMENT, run, attachment=event.data.root),)
        return (*self._of_drops(run), *self._of_state(run))

    def _of_drops(self, run: Run) -> Iterator[Notification]:
        for drop in run.drops:
            if self._is_new_question(drop):
                yield Notification(DeliveryEvent.DROP_CONSENT_ASKED, run, drop=drop)
            ended = (drop.outcome, drop.certainty)
            if drop.outcome in _BY_OUTCOME and self._drops.get(drop.plan_item_id) != ended:
                self._drops[drop.plan_item_id] = ended
                yield Notification(_BY_OUTCOME[drop.outcome], run, drop=drop)

    def _is_new_question(self, drop: DropRecord) -> bool:
        consent = drop.consent
        if consent is None or consent.state is not ConsentState.ASKED:
            return False
        before = self._questions.get(drop.plan_item_id)
        self._questions[drop.plan_item_id] = consent.question
        return consent.question != before

    def _of_state(self, run: Run) -> Iterator[Notification]:
        before, self._state = self._state, run.state
        if run.state is before:
            return
        kind = _flying_after(before) if run.state is RunState.FLYING else _BY_STATE.get(run.state)
        if kind is not None:
            yield Notification(kind, run)


def _flying_after(before: RunState | None) -> DeliveryEvent | None:
    if before is RunState.AT_DROP:
        return None
    return DeliveryEvent.RESUMED if before in (RunState.PAUSED, RunState.RETURNING) else DeliveryEvent.DEPARTED
