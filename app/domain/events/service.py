"""Events of the service itself, of its webhooks and of the simulator that it may have."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from app.domain.events.kinds import EventKind
from app.domain.events.payload import Payload
from app.domain.reason import Reason


class ServiceStarted(Payload):
    """The service started; `release` is the version of Waydrop."""

    kind: ClassVar = EventKind.SERVICE_STARTED

    release: str


class ServiceStopped(Payload):
    """The service stopped as it was asked to."""

    kind: ClassVar = EventKind.SERVICE_STOPPED


HookChange = Literal["created", "changed", "enabled", "disabled", "deleted"]


class WebhookChanged(Payload):
    """An administrator, or too many failures, changed a webhook. `reason` says why it is disabled."""

    kind: ClassVar = EventKind.WEBHOOK_CHANGED

    webhook_id: str
    change: HookChange
    host: str
    by: str
    reason: Reason | None = None


class SimulatorFault(Payload):
    """Stored before the simulated vehicle gets it, with problem null; once more with the reason when it did not."""

    kind: ClassVar = EventKind.SIMULATOR_FAULT

    fault: str
    value: Any
    by: str
    problem: str | None = None


class SimulatorSpeedSet(Payload):
    """Stored before the simulator gets it, with problem null; once more with the reason when it did not."""

    kind: ClassVar = EventKind.SIMULATOR_SPEED

    speed: float
    by: str
    problem: str | None = None
