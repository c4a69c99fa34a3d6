"""Events of the service, its webhooks and its simulator."""

from __future__ import annotations

from typing import Any, Literal

from app.domain.events.kinds import EventKind, Payload
from app.domain.jobs.job import Job, JobChangeWord
from app.domain.jobs.queue import VehicleQueue
from app.domain.model import FrozenForm
from app.domain.reasons import Reason
from app.domain.vehicle.link_security import RefusalKind
from app.domain.vehicle.state import VehicleType


class ServiceStarted(Payload, kind=EventKind.SERVICE_STARTED):
    """The service started; `release` is the version of Waydrop."""

    release: str


class ServiceStopped(Payload, kind=EventKind.SERVICE_STOPPED):
    """The service shut down."""


class LoopStalled(Payload, kind=EventKind.SERVICE_LOOP_STALLED):
    """The event loop was delayed. During the delay nothing was sent, received or decided.

    `delay_s` is the delay, `cpu_s` the CPU time of its thread during it: if much less, the machine was busy or
    something waited for a disk. `stack` is the stack after 0.1 s, innermost call last; empty if not captured. `others`
    counts shorter delays since the last such event.
    """

    delay_s: float
    cpu_s: float
    stack: tuple[str, ...]
    others: int = 0


class SiteLeaseChanged(Payload, kind=EventKind.SERVICE_SITE_LEASE):
    """Another gateway has this gateway's site, so nothing new begins here; null: it has its site again.

    `taken_by` is the other gateway: this gateway's own id if both have a copy of one journal. `has_expired`: its lease
    has, and a person may let this gateway take over.
    """

    site: str
    taken_by: str | None
    has_expired: bool = False


class PrunedChain(FrozenForm):
    """Where a gateway's chain begins after pruning: the seq and the hash of its newest pruned event."""

    gateway: str
    seq: int
    hash: str


class JournalPruned(Payload, kind=EventKind.JOURNAL_PRUNED):
    """Old events were deleted, as the retention settings say, up to position `up_to`. The chains go on from `chains`.

    Runs and jobs whose end was deleted are deleted with it, and so are old plans that no run or job uses. `before`: the
    deleted events are older (Unix seconds); null if none were. `attachments_before`: files that were attached earlier
    are deleted; null if none were.
    """

    up_to: int
    chains: tuple[PrunedChain, ...]
    before: float | None
    attachments_before: float | None


class LinkRefused(Payload, kind=EventKind.LINK_REFUSED):
    """The guards of the vehicle links refused frames, for one reason: at most one such event a minute and reason.

    `count` of them since the last one. `connections` are all that did, `peer` is where the newest came from, `systems`
    are system ids that were claimed, the first few.
    """

    refusal: RefusalKind
    count: int
    connections: tuple[str, ...]
    peer: str
    systems: tuple[int, ...]


class RequestAccepted(Payload, kind=EventKind.REQUEST_ACCEPTED):
    """A user's request or offboard frame was carried out: who asked for what. Reading is not recorded.

    `action` is the operation of the API or the type of the frame, `target` the path.
    """

    actor: str
    token_id: str
    action: str
    target: str


HookChange = Literal["created", "changed", "enabled", "disabled", "deleted"]


class WebhookChanged(Payload, kind=EventKind.WEBHOOK_CHANGED):
    """A webhook was changed by an administrator, or disabled by a 410 Gone. `reason` says why it is disabled."""

    webhook_id: str
    change: HookChange
    host: str
    actor: str
    reason: Reason | None = None


class SimulatorFault(Payload, kind=EventKind.SIMULATOR_FAULT):
    """Stored with problem null before the fault is set, and again with the reason if that failed."""

    fault: str
    value: Any
    actor: str
    problem: str | None = None


class SimulatorSpeedSet(Payload, kind=EventKind.SIMULATOR_SPEED):
    """Stored with problem null before the speed is set, and again with the reason if that failed."""

    speed: float
    actor: str
    problem: str | None = None


class PlanCreated(Payload, kind=EventKind.PLAN_CREATED):
    """A plan was stored. `created_at` is in Unix seconds."""

    plan_id: str
    hash: str
    name: str
    vehicle_type: VehicleType
    created_at: float
    created_by: str


class JobChanged(Payload, kind=EventKind.JOB_CHANGED):
    """A job after a change, and what happened to it."""

    change: JobChangeWord
    actor: str
    job: Job


class JobQueueChanged(Payload, kind=EventKind.JOB_QUEUE_CHANGED):
    """A vehicle's job queue after a change, and what happened to it."""

    change: Literal["stopped", "resumed", "cleared"]
    queue: VehicleQueue


ServicePayload = (
    ServiceStarted
    | ServiceStopped
    | LoopStalled
    | SiteLeaseChanged
    | JournalPruned
    | LinkRefused
    | RequestAccepted
    | WebhookChanged
    | SimulatorFault
    | SimulatorSpeedSet
    | PlanCreated
    | JobChanged
    | JobQueueChanged
)
