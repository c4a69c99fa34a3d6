"""Events of the service, its webhooks and its simulator."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from app.domain.events.kinds import EventKind, Payload
from app.domain.jobs.job import Job, JobChangeWord
from app.domain.jobs.queue import VehicleQueue
from app.domain.reasons import Reason
from app.domain.vehicle.link_security import RefusalKind
from app.domain.vehicle.state import VehicleType


class ServiceStarted(Payload):
    """The service started; `release` is the version of Waydrop."""

    kind: ClassVar = EventKind.SERVICE_STARTED

    release: str


class ServiceStopped(Payload):
    """The service shut down."""

    kind: ClassVar = EventKind.SERVICE_STOPPED


class LoopStalled(Payload):
    """The event loop was delayed. During the delay nothing was sent, received or decided.

    `delay_s` is the delay, `cpu_s` the CPU time of its thread during it: if much less, the machine was busy or
    something waited for a disk. `stack` is the stack after 0.1 s, innermost call last; empty if not captured. `others`
    counts shorter delays since the last such event.
    """

    kind: ClassVar = EventKind.SERVICE_LOOP_STALLED

    delay_s: float
    cpu_s: float
    stack: tuple[str, ...]
    others: int = 0


class LinkRefused(Payload):
    """The guards of the vehicle links refused frames, for one reason: at most one such event a minute and reason.

    `count` of them since the last one. `connections` are all that did, `peer` is where the newest came from, `systems`
    are system ids that were claimed, the first few.
    """

    kind: ClassVar = EventKind.LINK_REFUSED

    refusal: RefusalKind
    count: int
    connections: tuple[str, ...]
    peer: str
    systems: tuple[int, ...]


class RequestAccepted(Payload):
    """A user's request or offboard frame was carried out: who asked for what. Reading is not recorded.

    `action` is the operation of the API or the type of the frame, `target` the path.
    """

    kind: ClassVar = EventKind.REQUEST_ACCEPTED

    actor: str
    token_id: str
    action: str
    target: str


HookChange = Literal["created", "changed", "enabled", "disabled", "deleted"]


class WebhookChanged(Payload):
    """A webhook was changed by an administrator, or disabled by a 410 Gone. `reason` says why it is disabled."""

    kind: ClassVar = EventKind.WEBHOOK_CHANGED

    webhook_id: str
    change: HookChange
    host: str
    actor: str
    reason: Reason | None = None


class SimulatorFault(Payload):
    """Stored with problem null before the fault is set, and again with the reason if that failed."""

    kind: ClassVar = EventKind.SIMULATOR_FAULT

    fault: str
    value: Any
    actor: str
    problem: str | None = None


class SimulatorSpeedSet(Payload):
    """Stored with problem null before the speed is set, and again with the reason if that failed."""

    kind: ClassVar = EventKind.SIMULATOR_SPEED

    speed: float
    actor: str
    problem: str | None = None


# Events of plans, jobs and job queues.


class PlanCreated(Payload):
    """A plan was stored. `created_at` is in Unix seconds."""

    kind: ClassVar = EventKind.PLAN_CREATED

    plan_id: str
    hash: str
    name: str
    vehicle_type: VehicleType
    created_at: float
    created_by: str


class JobChanged(Payload):
    """A job after a change, and what happened to it."""

    kind: ClassVar = EventKind.JOB_CHANGED

    change: JobChangeWord
    actor: str
    job: Job


class JobQueueChanged(Payload):
    """A vehicle's job queue after a change, and what happened to it."""

    kind: ClassVar = EventKind.JOB_QUEUE_CHANGED

    change: Literal["stopped", "resumed", "cleared"]
    queue: VehicleQueue
