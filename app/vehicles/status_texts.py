"""STATUSTEXT: chunks joined, and the newest texts kept, because they are a vehicle's reasons for a refusal."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from app.domain.text import one_line
from app.domain.vehicle.facts import MavSeverity, StatusText
from app.domain.vehicle.state import FlightMode
from app.vehicles.arming_checks import ArmingChecks, is_of_check
from app.vehicles.decoders import EventReport, StatusTextChunk
from app.vehicles.event_reasons import Topic, begins_report, reason_of

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
_DELIVERIES: Final = (FlightMode.HOLD, FlightMode.MISSION)
"""A vehicle is armed in Hold and flies its mission: what keeps it from that is told whatever its mode is."""


@dataclass(slots=True)
class _Repeats:
    since_s: float
    last_s: float
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
        self._checks = ArmingChecks()

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
            self._emit_repeats(text, now_s)
        for key in [key for key, text in self._open.items() if now_s - text.since_s > _LOST_AFTER_S]:
            self._finish(key, now_s)

    def take_event(self, event: EventReport, received_s: float, *modes: FlightMode | None) -> None:
        """Keep and emit an EVENT in words; an arming check only if it concerns these modes or a delivery."""
        if begins_report(event):
            self._checks.begin(received_s)
        reason = reason_of(event)
        if reason is None:
            return
        if reason.is_check:
            self._checks.add(reason)
        if reason.concerns(*modes, *_DELIVERIES):
            self._add(reason.text, received_s, reason.topic)

    def failing_checks(self, mode: FlightMode) -> tuple[str, ...]:
        """What keeps the vehicle from being armed or flown in `mode`, as far as it was said."""
        return self._checks.failing(mode, time.monotonic())

    def _add(self, text: StatusText, received_s: float, topic: Topic | None = None) -> None:
        """Keep and emit; the topic of most STATUSTEXTs is not known."""
        if text.severity in _REASON_SEVERITIES:
            self._kept.append((received_s, text, topic))
            self._arrived.set()
        repeats = self._repeats.get(text)
        if repeats is not None and received_s - repeats.since_s <= _MERGED_S:
            repeats.count += 1
            repeats.last_s = received_s
            return
        if repeats is not None:
            self._emit_repeats(text, received_s)
        elif len(self._repeats) >= _MERGED:
            self._emit_repeats(next(iter(self._repeats)), received_s)
        self._repeats[text] = _Repeats(received_s, received_s)
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

    def _emit_repeats(self, text: StatusText, now_s: float) -> None:
        repeats = self._repeats.pop(text)
        if repeats.count:
            self._emit(replace(text, repeated=repeats.count, last_age_s=max(0.0, now_s - repeats.last_s)))

    def _finish(self, key: int, received_s: float) -> None:
        text = self._open.pop(key)
        self._keep(text.severity, "".join(text.chunks[n] for n in sorted(text.chunks)), received_s)

    def _keep(self, severity: int, text: str, received_s: float) -> None:
        known = _SEVERITIES[min(severity, len(_SEVERITIES) - 1)]  # MAVLink has no number beyond DEBUG
        clean = one_line(text).strip()
        if clean:
            self._checks.add_text(clean, received_s)
            topic = Topic.HEALTH if is_of_check(clean) else None
            self._add(StatusText(severity=known, text=clean), received_s, topic)
