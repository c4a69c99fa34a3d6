"""What is sent: one JSON document for each thing that is news of a delivery."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from app.domain.drop.record import Certainty, DropOutcome, DropRecord
from app.domain.events import Event, ServicePayload
from app.domain.events import service as events
from app.domain.jobs.job import Job, JobState
from app.domain.jobs.queue import VehicleQueue
from app.domain.model import Frozen
from app.domain.reasons import Reason
from app.domain.run.attachment import Attachment
from app.domain.run.run import LastPosition, Run, RunState
from app.domain.webhooks.lifecycle import DeliveryEvent, Notification


class DropSummary(Frozen):
    """How one drop of the run stands."""

    plan_item_id: str
    outcome: DropOutcome
    certainty: Certainty


class RunSummary(Frozen):
    """The run as it was at this moment. `order_id` is the plan's `order.id`, null without one."""

    id: str
    plan_id: str
    plan_hash: str
    order_id: str | None
    vehicle_id: str
    state: RunState
    reason: Reason | None
    requested_by: str
    created_at: float
    started_at: float | None
    ended_at: float | None
    last_position: LastPosition | None
    drops: tuple[DropSummary, ...]

    @classmethod
    def of(cls, run: Run, order_id: str | None) -> RunSummary:
        copied = {name: getattr(run, name) for name in cls.model_fields if name not in ("order_id", "drops")}
        drops = tuple(
            DropSummary(plan_item_id=drop.plan_item_id, outcome=drop.outcome, certainty=drop.certainty)
            for drop in run.drops
        )
        return cls(order_id=order_id, drops=drops, **copied)


class Message(Frozen):
    """The body of one request. Times are Unix seconds.

    `id` is the same in each repetition: a receiver that knows it returns 2xx and does nothing. `seq` and `hash` are the
    position of the event in the chain of the journal: store them, and `waydrop verify-journal --anchor SEQ:HASH` later
    shows whether the journal was altered. `drop`, `attachment`, `job` or `queue` is present if `type` concerns one.
    """

    id: str
    type: DeliveryEvent
    time: float
    gateway: str
    seq: int | None = None
    hash: str | None = None
    run: RunSummary | None = None
    drop: DropRecord | None = None
    attachment: Attachment | None = None
    job: Job | None = None
    queue: VehicleQueue | None = None

    def body(self) -> bytes:
        """The bytes that are signed and sent; the same each time."""
        return self.model_dump_json().encode()


def messages_of(event: Event, notifications: Sequence[Notification], order_id: str | None) -> tuple[Message, ...]:
    """The messages of one event, with the IDs GATEWAY:SEQ:HASH, GATEWAY:SEQ:HASH.1 and so on."""
    return tuple(
        _message(
            event, one.type, number, run=RunSummary.of(one.run, order_id), drop=one.drop, attachment=one.attachment
        )
        for number, one in enumerate(notifications)
    )


_BY_CHANGE: Final = {
    "queued": DeliveryEvent.JOB_QUEUED,
    "assigned": DeliveryEvent.JOB_ASSIGNED,
    "requeued": DeliveryEvent.JOB_REQUEUED,
}
_BY_END: Final = {
    JobState.COMPLETED: DeliveryEvent.JOB_COMPLETED,
    JobState.FAILED: DeliveryEvent.JOB_FAILED,
    JobState.CANCELLED: DeliveryEvent.JOB_CANCELLED,
    JobState.EXPIRED: DeliveryEvent.JOB_EXPIRED,
}
_BY_QUEUE: Final = {"stopped": DeliveryEvent.QUEUE_STOPPED, "resumed": DeliveryEvent.QUEUE_RESUMED}


def job_messages(event: Event) -> tuple[Message, ...]:
    """The message of an event of jobs; none if it is no news."""
    if not isinstance(event.data, ServicePayload):
        return ()
    match event.data:
        case events.JobChanged(change=change, job=job):
            kind = _BY_END.get(job.state) if change == "ended" else _BY_CHANGE.get(change)
            return () if kind is None else (_message(event, kind, job=job),)
        case events.JobQueueChanged(change=change, queue=queue):
            news = _BY_QUEUE.get(change)
            return () if news is None else (_message(event, news, queue=queue),)
        case (
            events.ServiceStarted()
            | events.ServiceStopped()
            | events.LoopStalled()
            | events.SiteLeaseChanged()
            | events.JournalPruned()
            | events.LinkRefused()
            | events.RequestAccepted()
            | events.WebhookChanged()
            | events.SimulatorFault()
            | events.SimulatorSpeedSet()
            | events.PlanCreated()
        ):
            return ()


ID_HASH_CHARS: Final = 12
"""After a backup is restored, a `seq` is used again for another event; its hash is another one."""


def _message(event: Event, kind: DeliveryEvent, number: int = 0, **about: Any) -> Message:
    return Message(
        id=f"{event.gateway}:{event.seq}:{event.hash[:ID_HASH_CHARS]}" + (f".{number}" if number else ""),
        type=kind,
        time=event.time,
        gateway=event.gateway,
        seq=event.seq,
        hash=event.hash,
        **about,
    )
