"""What the websocket carries, server to client: one JSON object in each text frame, told apart by `type`."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import Final, Literal

from pydantic import BaseModel

from app.domain.events import Event
from app.domain.run.run import Run
from app.services.views import StateView, VehicleView

_FINAL_TEXT: Final = 0x81
_HEADER_16: Final = struct.Struct("!BBH")
_HEADER_64: Final = struct.Struct("!BBQ")


class HelloFrame(BaseModel):
    """The first frame. `seq` is the newest event of this gateway; `server_time` is Unix seconds."""

    type: Literal["hello"] = "hello"
    gateway: str
    seq: int
    server_time: float


class SnapshotFrame(BaseModel):
    """The second frame: how things are. It contains at least every event up to `seq`; later ones still come."""

    type: Literal["snapshot"] = "snapshot"
    seq: int
    vehicles: list[VehicleView]
    runs: list[Run]


class EventFrame(BaseModel):
    """An event. Each comes once, in order: those after `after` if that was asked, else those after `seq` of hello."""

    type: Literal["event"] = "event"
    event: Event


class TelemetryFrame(BaseModel):
    """The newest state of vehicles, by id. A slow client gets fewer of these, never older ones."""

    type: Literal["telemetry"] = "telemetry"
    time: float
    vehicles: dict[str, StateView]


FRAMES: tuple[type[BaseModel], ...] = (HelloFrame, SnapshotFrame, EventFrame, TelemetryFrame)


class CloseCode(IntEnum):
    """Why a socket was closed by the service."""

    GOING_AWAY = 1001
    """The service stops."""
    POLICY = 1008
    """The client sends; it should only listen."""
    DEFECT = 1011
    """A defect of the service; its log has it."""
    TRY_AGAIN = 1013
    """The journal cannot be read now."""
    BAD_AFTER = 4400
    """`after` is not a whole number of 0 or more."""
    UNAUTHORIZED = 4401
    """No token, or not a valid one."""
    TOO_SLOW = 4408
    """The client did not read: connect again with after= the last event seen."""
    AFTER_AHEAD = 4409
    """`after` is higher than the newest event: it belongs to another journal. Start without it."""


CLOSE_REASONS: Final[dict[CloseCode, str]] = {
    CloseCode.GOING_AWAY: "the service stops",
    CloseCode.POLICY: "this socket only tells; send nothing",
    CloseCode.DEFECT: "a defect of the service",
    CloseCode.TRY_AGAIN: "the journal cannot be read now",
    CloseCode.BAD_AFTER: "after= must be a whole number of 0 or more",
    CloseCode.UNAUTHORIZED: "a valid token is needed",
    CloseCode.TOO_SLOW: "too slow: connect again with after= the last event seen",
    CloseCode.AFTER_AHEAD: "after= is ahead of the newest event: it is of another journal; connect without it",
}
"""Told with the code, for people; at most 123 bytes (RFC 6455)."""


def event_frame(event: Event) -> bytes:
    """The frame of an event, made once for all sockets."""
    return text_frame(b'{"type":"event","event":' + event.model_dump_json().encode() + b"}")


def text_frame(payload: bytes) -> bytes:
    """A text frame as it goes over the wire (RFC 6455 5.2): final, not masked, not compressed."""
    size = len(payload)
    if size < 126:
        return bytes((_FINAL_TEXT, size)) + payload
    if size < 65536:
        return _HEADER_16.pack(_FINAL_TEXT, 126, size) + payload
    return _HEADER_64.pack(_FINAL_TEXT, 127, size) + payload
