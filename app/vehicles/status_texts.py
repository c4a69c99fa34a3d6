"""STATUSTEXT: chunks joined, and the newest texts kept, because they are a vehicle's reasons for a refusal."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Final, NamedTuple

from app.domain.text import one_line
from app.domain.vehicle.facts import MavSeverity, StatusText
from app.vehicles.decoders import EventReport, StatusTextChunk

# PX4 EVENTs in words, for reasons that no STATUSTEXT gives.
#
# PX4 names an event by a hash and keeps the words in metadata that a ground station must fetch. These few say why a
# mission was not accepted or a failsafe acts; recorded from PX4 v1.18 (main, 2026-08). Others are left out.


class Topic(Enum):
    """What a reason is about. PX4 sends its health report anew at each upload, whatever was uploaded."""

    MISSION = auto()
    HEALTH = auto()


class Reason(NamedTuple):
    """An event in words."""

    text: StatusText
    topic: Topic


def _reason(severity: MavSeverity, text: str, topic: Topic) -> Reason:
    return Reason(StatusText(severity=severity, text=text), topic)


_REASONS: Final = {
    19546926: _reason(MavSeverity.ERROR, "Mission rejected: add a landing item or remove the takeoff", Topic.MISSION),
    21551397: _reason(
        MavSeverity.ERROR, "Mission rejected: the landing glide slope is steeper than the vehicle allows", Topic.MISSION
    ),
    25237137: _reason(MavSeverity.ERROR, "Mission rejected: landing waypoint or pattern required", Topic.MISSION),
    33440290: _reason(MavSeverity.ERROR, "Mission rejected: takeoff is not the first waypoint item", Topic.MISSION),
    22091529: _reason(MavSeverity.WARNING, "First waypoint far away from home", Topic.MISSION),
    27571288: _reason(MavSeverity.ERROR, "Connection to ground control station lost", Topic.HEALTH),
    28241790: _reason(MavSeverity.ERROR, "No offboard signal", Topic.HEALTH),
}


def reason_of(event: EventReport) -> Reason | None:
    """The event as a reason; None if it is none of those."""
    return _REASONS.get(event.id)


_SEVERITIES: Final = tuple(MavSeverity)
_CHUNK_CHARS: Final = 50
_CHUNKS: Final = 8
_LOST_AFTER_S: Final = 1.0
_KEPT: Final = 64
_MERGED_S: Final = 10.0
"""The same text again within this time is counted."""
_MERGED: Final = 64
"""So many different texts are watched for repetitions."""
_REASON_SEVERITIES: Final = frozenset(_SEVERITIES[:5])


@dataclass(slots=True)
class _Repeats:
    since_s: float
    count: int = 0


@dataclass(slots=True)
class _Open:
    severity: int
    since_s: float
    chunks: dict[int, str]


class StatusTexts:
    """Joins texts of more than 50 bytes. A text whose end is lost is emitted when another begins, or after a second."""

    def __init__(self, emit: Callable[[StatusText], None]) -> None:
        self._emit = emit
        self._open: dict[int, _Open] = {}
        self._repeats: dict[StatusText, _Repeats] = {}
        self._kept: deque[tuple[float, StatusText, Topic | None]] = deque(maxlen=_KEPT)
        self._arrived = asyncio.Event()

    def take(self, chunk: StatusTextChunk, received_s: float) -> None:
        for other in [key for key in self._open if key != chunk.id]:
            self._finish(other, received_s)
        if chunk.id == 0:
            self._keep(chunk.severity, chunk.text, received_s)
            return
        text = self._open.setdefault(chunk.id, _Open(chunk.severity, received_s, {}))
        text.chunks[chunk.chunk_seq] = chunk.text
        ended = len(chunk.text.encode()) < _CHUNK_CHARS
        complete = len(text.chunks) == max(text.chunks) + 1
        if (ended and complete) or len(text.chunks) >= _CHUNKS:
            self._finish(chunk.id, received_s)

    def tick(self, now_s: float) -> None:
        """Emit texts whose end does not come, and the counts of repeated ones."""
        for text in [text for text, repeats in self._repeats.items() if now_s - repeats.since_s > _MERGED_S]:
            self._emit_repeats(text)
        for key in [key for key, text in self._open.items() if now_s - text.since_s > _LOST_AFTER_S]:
            self._finish(key, now_s)

    def add(self, text: StatusText, received_s: float, topic: Topic | None = None) -> None:
        """Keep and emit a text from elsewhere (an EVENT in words); the topic of a STATUSTEXT is not known."""
        if text.severity in _REASON_SEVERITIES:
            self._kept.append((received_s, text, topic))
            self._arrived.set()
        repeats = self._repeats.get(text)
        if repeats is not None and received_s - repeats.since_s <= _MERGED_S:
            repeats.count += 1
            return
        if repeats is not None:
            self._emit_repeats(text)
        elif len(self._repeats) >= _MERGED:
            self._emit_repeats(next(iter(self._repeats)))
        self._repeats[text] = _Repeats(received_s)
        self._emit(text)

    def reasons_since(self, since_s: float, *, but: Topic | None = None) -> tuple[str, ...]:
        """Texts of severity warning and above since `since_s` (monotonic), each once, without those about `but`."""
        found = [
            text.text for at_s, text, topic in self._kept if at_s >= since_s and (topic is None or topic is not but)
        ]
        return tuple(dict.fromkeys(found))

    async def await_reasons(self, since_s: float, *, window_s: float, but: Topic | None = None) -> tuple[str, ...]:
        """As reasons_since, but waits up to `window_s` for the first one: texts may follow the ack they explain."""
        try:
            async with asyncio.timeout(window_s):
                while not self.reasons_since(since_s, but=but):
                    self._arrived.clear()
                    await self._arrived.wait()
        except TimeoutError:
            pass
        return self.reasons_since(since_s, but=but)

    def _emit_repeats(self, text: StatusText) -> None:
        repeats = self._repeats.pop(text)
        if repeats.count:
            self._emit(replace(text, repeated=repeats.count))

    def _finish(self, key: int, received_s: float) -> None:
        text = self._open.pop(key)
        self._keep(text.severity, "".join(text.chunks[n] for n in sorted(text.chunks)), received_s)

    def _keep(self, severity: int, text: str, received_s: float) -> None:
        known = _SEVERITIES[min(severity, len(_SEVERITIES) - 1)]  # MAVLink has no number beyond DEBUG
        clean = one_line(text).strip()
        if clean:
            self.add(StatusText(severity=known, text=clean), received_s)
