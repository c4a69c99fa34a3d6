"""The kinds of events. Their payloads are in this folder."""

from __future__ import annotations

from enum import StrEnum
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, RootModel


class EventKind(StrEnum):
    """The kind of an event. PAYLOADS has the payload model of each."""

    SERVICE_STARTED = "service.started"
    SERVICE_STOPPED = "service.stopped"
    SERVICE_LOOP_STALLED = "service.loop_stalled"
    SERVICE_SITE_LEASE = "service.site_lease"
    JOURNAL_PRUNED = "journal.pruned"
    REQUEST_ACCEPTED = "request.accepted"
    VEHICLE_SEEN = "vehicle.seen"
    VEHICLE_LINK_LOST = "vehicle.link_lost"
    VEHICLE_LINK_RESTORED = "vehicle.link_restored"
    VEHICLE_CHANGED = "vehicle.changed"
    VEHICLE_PARAMETERS = "vehicle.parameters"
    VEHICLE_REBOOTED = "vehicle.rebooted"
    VEHICLE_STATUS_TEXT = "vehicle.status_text"
    VEHICLE_QUARANTINED = "vehicle.quarantined"
    VEHICLE_QUARANTINE_ENDED = "vehicle.quarantine_ended"
    VEHICLE_COMMANDED_IN_QUARANTINE = "vehicle.commanded_in_quarantine"
    VEHICLE_LINK_SECURITY = "vehicle.link_security"
    VEHICLE_LINK_KEY = "vehicle.link_key"
    LINK_REFUSED = "link.refused"
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
    RUN_TAKEN_OVER = "run.taken_over"
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
    """Base of payloads: their kind and the version of their form.

    When you change a form, increase `version` and override `upcast`, which converts data of earlier versions.
    """

    kind: ClassVar[EventKind]
    version: ClassVar[int] = 1

    def __init_subclass__(cls, kind: EventKind | None = None, **config: Any) -> None:
        super().__init_subclass__(**config)
        if kind is not None:
            cls.kind = kind

    @classmethod
    def upcast(cls, version: int, data: Any) -> Any:
        """Convert JSON data of an earlier version. Raises ValueError if the version is not supported."""
        raise ValueError(f"unsupported version {version} of {cls.kind.value}; the current version is {cls.version}")


class Payload(Versioned, BaseModel):
    """The payload of one kind."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class WholePayload(Versioned, RootModel[T], Generic[T]):
    """A payload that is a whole record, `root`."""

    model_config = ConfigDict(frozen=True)
