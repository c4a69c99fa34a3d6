"""What events of jobs tell other systems. Each has the whole job or queue in it, so no earlier one is needed."""

from __future__ import annotations

from typing import Any, Final

from pydantic import ValidationError

from app.domain.events import Event, EventKind
from app.domain.jobs.job import Job, JobState
from app.domain.jobs.vehicle_queue import VehicleQueue
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
    """The message of an event of jobs; none if it is no news, or was written by a version that this one cannot read."""
    change = event.data.get("change")
    try:
        match event.kind:
            case EventKind.JOB_CHANGED:
                job = Job.model_validate(event.data.get("job"))
                told = _BY_END.get(job.state) if change == "ended" else _BY_CHANGE.get(str(change))
                return _message(event, told, job=job)
            case EventKind.JOB_QUEUE_CHANGED:
                queue = VehicleQueue.model_validate(event.data.get("queue"))
                return _message(event, _BY_QUEUE.get(str(change)), queue=queue)
    except ValidationError:
        return ()
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
