"""What other systems are told of jobs and queues."""

from __future__ import annotations

import pytest

from app.domain.events import AnyPayload, Event, NewEvent
from app.domain.events.service import JobChanged, JobQueueChanged, ServiceStopped
from app.domain.jobs.job import JobChangeWord, JobState
from app.domain.jobs.queue import VehicleQueue
from app.domain.webhooks.message import job_messages
from tests.support.job_examples import a_job
from tests.support.reasons import some

HASH = "9d0e4b7f21c8" + "0" * 52


def event_of(payload: AnyPayload) -> Event:
    return NewEvent.of(payload, 5.0).numbered(7, "gw-1", HASH)


def told(payload: AnyPayload) -> list[str]:
    messages = job_messages(event_of(payload))
    expected = (f"gw-1:7:{HASH[:12]}", 5.0, 7, HASH, None)
    assert all((one.id, one.time, one.seq, one.hash, one.run) == expected for one in messages)
    return [one.type.value for one in messages]


@pytest.mark.parametrize(
    ("change", "state", "types"),
    [
        ("queued", JobState.QUEUED, ["job.queued"]),
        ("assigned", JobState.PREPARING, ["job.assigned"]),
        ("requeued", JobState.QUEUED, ["job.requeued"]),
        ("ended", JobState.COMPLETED, ["job.completed"]),
        ("ended", JobState.FAILED, ["job.failed"]),
        ("ended", JobState.CANCELLED, ["job.cancelled"]),
        ("ended", JobState.EXPIRED, ["job.expired"]),
        ("placed", JobState.QUEUED, []),
        ("prepared", JobState.PREPARED, []),
        ("started", JobState.FLYING, []),
    ],
)
def test_each_change_that_is_news_is_told_once(change: JobChangeWord, state: JobState, types: list[str]) -> None:
    assert told(JobChanged(change=change, actor="desk", job=a_job(state=state))) == types


def test_the_whole_job_goes_with_it() -> None:
    job = a_job(reason=some("because"), vehicle_id="v1")
    assert job_messages(event_of(JobChanged(change="queued", actor="desk", job=job)))[0].job == job


def test_a_queue_that_stops_or_goes_on_is_told() -> None:
    queue = VehicleQueue(vehicle_id="v1", stopped=True, reason=some("run r failed"))
    assert told(JobQueueChanged(change="stopped", queue=queue)) == ["queue.stopped"]
    assert told(JobQueueChanged(change="resumed", queue=queue)) == ["queue.resumed"]
    assert told(JobQueueChanged(change="cleared", queue=queue)) == []


def test_what_is_of_no_job_is_no_news() -> None:
    assert told(ServiceStopped()) == []
