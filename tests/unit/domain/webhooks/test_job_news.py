"""What other systems are told of jobs and queues."""

from __future__ import annotations

import pytest

from app.domain.events import Event, EventKind
from app.domain.jobs.job import JobState
from app.domain.jobs.vehicle_queue import VehicleQueue
from app.domain.webhooks.job_news import job_messages
from tests.unit.domain.jobs.examples import a_job


def told(kind: EventKind, **data: object) -> list[str]:
    event = Event(kind=kind, time=5.0, data=data, seq=7, gateway="gw-1", hash="ab")
    messages = job_messages(event)
    assert all((one.id, one.time, one.seq, one.hash, one.run) == ("gw-1:7", 5.0, 7, "ab", None) for one in messages)
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
def test_each_change_that_is_news_is_told_once(change: str, state: JobState, types: list[str]) -> None:
    document = a_job(state=state).model_dump(mode="json")
    assert told(EventKind.JOB_CHANGED, change=change, by="desk", job=document) == types


def test_the_whole_job_goes_with_it() -> None:
    job = a_job(reason="because", vehicle_id="v1")
    data = {"change": "queued", "job": job.model_dump(mode="json")}
    event = Event(kind=EventKind.JOB_CHANGED, time=5.0, data=data, seq=7, gateway="gw-1", hash="ab")
    assert job_messages(event)[0].job == job


def test_a_queue_that_stops_or_goes_on_is_told() -> None:
    queue = VehicleQueue(vehicle_id="v1", stopped=True, reason="run r failed").model_dump(mode="json")
    assert told(EventKind.JOB_QUEUE_CHANGED, change="stopped", queue=queue) == ["queue.stopped"]
    assert told(EventKind.JOB_QUEUE_CHANGED, change="resumed", queue=queue) == ["queue.resumed"]
    assert told(EventKind.JOB_QUEUE_CHANGED, change="cleared", queue=queue) == []


def test_what_another_version_wrote_or_is_of_no_job_is_no_news() -> None:
    assert told(EventKind.JOB_CHANGED, change="queued", job={"id": "job-1", "later": 1}) == []
    assert told(EventKind.JOB_CHANGED) == []
    assert told(EventKind.SERVICE_STARTED) == []
