"""The kinds of events. What each one tells is the payload of that kind, in this folder."""

from __future__ import annotations

from enum import StrEnum
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, RootModel


class EventKind(StrEnum):
    """What an event says. One payload model for each, see PAYLOADS."""

    SERVICE_STARTED = "service.started"
    SERVICE_STOPPED = "service.stopped"
    SERVICE_LOOP_STALLED = "service.loop_stalled"
    VEHICLE_SEEN = "vehicle.seen"
    VEHICLE_LINK_LOST = "vehicle.link_lost"
    VEHICLE_LINK_RESTORED = "vehicle.link_restored"
    VEHICLE_CHANGED = "vehicle.changed"
    VEHICLE_PARAMETERS = "vehicle.parameters"
    VEHICLE_REBOOTED = "vehicle.rebooted"
    VEHICLE_STATUS_TEXT = "vehicle.status_text"
    VEHICLE_QUARANTINED = "vehicle.quarantined"
    VEHICLE_COMMAND = "vehicle.command"
    OFFBOARD_LEASE = "offboard.lease"
    OFFBOARD_CHANGED = "offboard.changed"
    TASK_CHANGED = "task.changed"
    TASK_GRIPPER = "task.gripper"
    PLAN_CREATED = "plan.created"
    RUN_CREATED = "run.created"
    RUN_CHANGED = "run.changed"
    RUN_PREDICTED = "run.predicted"
    RUN_PLAN_REFUSED = "run.plan_refused"
    RUN_UPLOAD_PROGRESS = "run.upload_progress"
    RUN_MISSION_CHANGED = "run.mission_changed"
    RUN_CONTINUED = "run.continued"
    RUN_TARGET_MOVED = "run.target_moved"
    RUN_TARGET_NOT_FOLLOWED = "run.target_not_followed"
    RUN_ITEM = "run.item"
    RUN_ITEM_ENDED = "run.item_ended"
    RUN_COMMAND = "run.command"
    RUN_ACK = "run.ack"
    RUN_DROP = "run.drop"
    RUN_ATTACHMENT = "run.attachment"
    DROP_CONSENT_ASKED = "drop.consent_asked"
    DROP_CONSENT_CLOSED = "drop.consent_closed"
    SIMULATOR_FAULT = "simulator.fault"
    SIMULATOR_SPEED = "simulator.speed"
    JOB_CHANGED = "job.changed"
    JOB_QUEUE_CHANGED = "job.queue_changed"
    WEBHOOK_CHANGED = "webhook.changed"


T = TypeVar("T")


class Versioned:
    """What all payloads have in common: their kind, and the version of their form.

    A change of a form raises `version` and overrides `upcast`, which is called with what was stored or sent before.
    """

    kind: ClassVar[EventKind]
    version: ClassVar[int] = 1

    @classmethod
    def upcast(cls, version: int, data: Any) -> Any:
        """JSON data of an earlier version, in the present form. Raises ValueError for a version that cannot be read."""
        raise ValueError(f"{cls.kind.value} has version {cls.version}; version {version} cannot be read")


class Payload(Versioned, BaseModel):
    """What an event of one kind tells."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class WholePayload(Versioned, RootModel[T], Generic[T]):
    """A payload that is one whole record, `root`, and nothing beside it."""

    model_config = ConfigDict(frozen=True)
