"""Events of the service itself, of its webhooks and of the simulator that it may have."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from app.domain.events.kinds import EventKind, Payload
from app.domain.jobs.job import Job, JobChangeWord
from app.domain.jobs.queue import VehicleQueue
from app.domain.reasons import Reason
from app.domain.vehicle.state import VehicleType


class ServiceStarted(Payload):
    """The service started; `release` is the version of Waydrop."""

    kind: ClassVar = EventKind.SERVICE_STARTED

    release: str


class ServiceStopped(Payload):
    """The service stopped as it was asked to."""

    kind: ClassVar = EventKind.SERVICE_STOPPED


class LoopStalled(Payload):
    """The event loop turned later than it should: meanwhile nothing was sent, received or decided.

    `delay_s` is by how much, `cpu_s` how long its thread computed meanwhile: much less, and the machine was busy or
    something waited for a disk. `stack` is where it stood after 0.1 s, the innermost call last; empty: nobody saw.
    `others` came since the last such event and were not as long.
    """

    kind: ClassVar = EventKind.SERVICE_LOOP_STALLED

    delay_s: float
    cpu_s: float
    stack: tuple[str, ...]
    others: int = 0


HookChange = Literal["created", "changed", "enabled", "disabled", "deleted"]


class WebhookChanged(Payload):
    """An administrator, or too many failures, changed a webhook. `reason` says why it is disabled."""

    kind: ClassVar = EventKind.WEBHOOK_CHANGED

    webhook_id: str
    change: HookChange
    host: str
    actor: str
    reason: Reason | None = None


class SimulatorFault(Payload):
    """Stored before the simulated vehicle gets it, with problem null; once more with the reason when it did not."""

    kind: ClassVar = EventKind.SIMULATOR_FAULT

    fault: str
    value: Any
    actor: str
    problem: str | None = None


class SimulatorSpeedSet(Payload):
    """Stored before the simulator gets it, with problem null; once more with the reason when it did not."""

    kind: ClassVar = EventKind.SIMULATOR_SPEED

    speed: float
    actor: str
    problem: str | None = None


# Events of plans, jobs and the vehicles' queues of jobs.


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
    actor: str
    job: Job


class JobQueueChanged(Payload):
    """A vehicle's queue of jobs, whole, and what happened to it."""

    kind: ClassVar = EventKind.JOB_QUEUE_CHANGED

    change: Literal["stopped", "resumed", "cleared"]
    queue: VehicleQueue
