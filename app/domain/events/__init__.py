"""Events and their payloads."""

from app.domain.events.event import PAYLOADS, AnyPayload, Event, NewEvent, payload_of
from app.domain.events.kinds import EventKind
from app.domain.events.run import RunPayload
from app.domain.events.service import ServicePayload
from app.domain.events.vehicle import VehiclePayload

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
