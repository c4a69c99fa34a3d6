"""Events of plans, jobs and the vehicles' queues of jobs."""

from __future__ import annotations

from typing import ClassVar, Literal

from app.domain.events.kinds import EventKind
from app.domain.events.payload import Payload
from app.domain.jobs.change import JobChangeWord
from app.domain.jobs.job import Job
from app.domain.jobs.vehicle_queue import VehicleQueue
from app.domain.vehicle import VehicleType


class PlanCreated(Payload):
    """A plan was stored. `created_at` is Unix seconds."""

    kind: ClassVar = EventKind.PLAN_CREATED

    plan_id: str
    hash: str
    name: str
    vehicle_type: VehicleType
    created_at: float
    created_by: str


class JobChanged(Payload):
    """A job, whole, and what happened to it."""

    kind: ClassVar = EventKind.JOB_CHANGED

    change: JobChangeWord
    by: str
    job: Job


class JobQueueChanged(Payload):
    """A vehicle's queue of jobs, whole, and what happened to it."""

    kind: ClassVar = EventKind.JOB_QUEUE_CHANGED

    change: Literal["stopped", "resumed", "cleared"]
    queue: VehicleQueue
