"""Frames of the event websocket: one JSON object per text frame, discriminated by `type`."""

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
    """The first frame. `seq` is the position of the newest event; `server_time` is in Unix seconds.

    `gateway` names the journal, of a gateway or of a cluster. `after` counts the positions in this journal.
    """

    type: Literal["hello"] = "hello"
    gateway: str
    seq: int
    server_time: float


class SnapshotFrame(BaseModel):
    """The second frame: the current state. It includes all events up to `seq`; later events follow."""

    type: Literal["snapshot"] = "snapshot"
    seq: int
    vehicles: list[VehicleView]
    runs: list[Run]


class EventFrame(BaseModel):
    """An event. Each is sent once, in order: those after `after` if requested, else those after `seq` of hello."""

    type: Literal["event"] = "event"
    event: Event


class TelemetryFrame(BaseModel):
    """The newest state of vehicles, by ID. A slow client receives fewer of these, but never outdated ones."""

    type: Literal["telemetry"] = "telemetry"
    time: float
    vehicles: dict[str, StateView]


FRAMES: tuple[type[BaseModel], ...] = (HelloFrame, SnapshotFrame, EventFrame, TelemetryFrame)


class CloseCode(IntEnum):
    """Close codes of the event websocket."""

    GOING_AWAY = 1001
    """The service is shutting down."""
    POLICY = 1008
    """The client sent a frame. This socket is read-only."""
    DEFECT = 1011
    """Internal server error; details are in the log."""
    TRY_AGAIN = 1013
    """The journal is temporarily unavailable, or the address sent too many invalid tokens."""
    BAD_AFTER = 4400
    """`after` is not a non-negative integer."""
    UNAUTHORIZED = 4401
    """Missing or invalid token."""
    TOO_SLOW = 4408
    """The client reads too slowly. Reconnect with after= the last event received."""
    AFTER_AHEAD = 4409
    """`after` belongs to another journal: it is greater than the newest event, or `gateway` differs."""


CLOSE_REASONS: Final[dict[CloseCode, str]] = {
    CloseCode.GOING_AWAY: "the service is shutting down",
    CloseCode.POLICY: "this socket is read-only; send nothing",
    CloseCode.DEFECT: "internal server error",
    CloseCode.TRY_AGAIN: "temporarily unavailable; connect again later",
    CloseCode.BAD_AFTER: "after= must be a non-negative integer",
    CloseCode.UNAUTHORIZED: "a valid token is required",
    CloseCode.TOO_SLOW: "too slow: reconnect with after= the last event received",
    CloseCode.AFTER_AHEAD: "after= belongs to another journal; reconnect without it",
}
"""Close reasons, for people; at most 123 bytes (RFC 6455)."""


def event_frame(event: Event) -> bytes:
    """Encode an event. The frame is built once for all sockets."""
    return text_frame(b'{"type":"event","event":' + event.model_dump_json().encode() + b"}")


def text_frame(payload: bytes) -> bytes:
    """Encode a text frame (RFC 6455 5.2): final, unmasked, uncompressed."""
    size = len(payload)
    if size < 126:
        return bytes((_FINAL_TEXT, size)) + payload
    if size < 65536:
        return _HEADER_16.pack(_FINAL_TEXT, 126, size) + payload
    return _HEADER_64.pack(_FINAL_TEXT, 127, size) + payload
