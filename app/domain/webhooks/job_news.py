"""What events of jobs tell other systems. Each has the whole job or queue in it, so no earlier one is needed."""

from __future__ import annotations

from typing import Any, Final

from app.domain.events import Event
from app.domain.events.dispatch import JobChanged, JobQueueChanged
from app.domain.jobs.job import JobState
from app.domain.webhooks.lifecycle import DeliveryEvent
from app.domain.webhooks.message import Message

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
    match event.data:
        case JobChanged(change=change, job=job):
            told = _BY_END.get(job.state) if change == "ended" else _BY_CHANGE.get(change)
            return _message(event, told, job=job)
        case JobQueueChanged(change=change, queue=queue):
            return _message(event, _BY_QUEUE.get(change), queue=queue)
        case _:
            return ()


def _message(event: Event, told: DeliveryEvent | None, **about: Any) -> tuple[Message, ...]:
    if told is None:
        return ()
    message = Message(
        id=f"{event.gateway}:{event.seq}",
        type=told,
        time=event.time,
        gateway=event.gateway,
        seq=event.seq,
        hash=event.hash,
        **about,
    )
    return (message,)
