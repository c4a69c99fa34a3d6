"""Events and their payloads."""

from app.domain.events.event import (
    PAYLOADS,
    AnyPayload,
    Event,
    NewEvent,
    RunPayload,
    ServicePayload,
    VehiclePayload,
    payload_of,
)
from app.domain.events.kinds import EventKind

__all__ = [
    "PAYLOADS",
    "AnyPayload",
    "Event",
    "EventKind",
    "NewEvent",
    "RunPayload",
    "ServicePayload",
    "VehiclePayload",
    "payload_of",
]
