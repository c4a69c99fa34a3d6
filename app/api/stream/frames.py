"""Frames of the event websocket: one JSON object per text frame, discriminated by `type`."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Final, Literal

from pydantic import BaseModel

from app.api.websockets import COMMON_CLOSE_REASONS, CloseCode
from app.domain.events import Event
from app.domain.run.run import Run
from app.services.views import StateView, VehicleView

_FINAL_TEXT: Final = 0x81
_HEADER_16: Final = struct.Struct("!BBH")
_HEADER_64: Final = struct.Struct("!BBQ")


class HelloFrame(BaseModel):
    """The first frame. `seq` is the position of the newest event; `server_time` is in Unix seconds.

    `first_seq` is the position of the oldest event that is kept: `after` may be one less, or more.

    `gateway` names the journal, of a gateway or of a cluster. `after` counts the positions in this journal.
    """

    type: Literal["hello"] = "hello"
    gateway: str
    first_seq: int
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
    """The newest state of vehicles, by ID. A slow client receives fewer of these, but never outdated ones.

    `recording`: false after a write of events failed, until the next one succeeds. Runs, drops and jobs may then be as
    they were before: what changed since comes once it is stored. An API node of a cluster says whether it can read the
    cluster's store, and nothing of the gateways' own disks.
    """

    type: Literal["telemetry"] = "telemetry"
    time: float
    recording: bool
    vehicles: dict[str, StateView]


FRAMES: tuple[type[BaseModel], ...] = (HelloFrame, SnapshotFrame, EventFrame, TelemetryFrame)


CLOSE_REASONS: Final[Mapping[CloseCode, str]] = {
    **COMMON_CLOSE_REASONS,
    CloseCode.POLICY: "this socket is read-only; send nothing",
    CloseCode.BAD_QUERY: "after= must be a non-negative integer, gateway= belongs to it, and nothing else is known",
    CloseCode.TOO_SLOW: "too slow: reconnect with after= the last event received",
    CloseCode.AFTER_AHEAD: "after= belongs to another journal; reconnect without it",
    CloseCode.AFTER_PRUNED: "events after after= were deleted by age; reconnect without after, or with after=0",
}


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
