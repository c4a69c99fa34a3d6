"""How steadily setpoints leave: the intervals between the last sends."""

from __future__ import annotations

from collections import deque

from app.services.offboard_view import CadenceView

KEPT = 200


class Cadence:
    """The last send intervals of one stream, in seconds."""

    def __init__(self, wanted_hz: float) -> None:
        self.wanted_hz = wanted_hz
        self.sends = 0
        self._last_s: float | None = None
        self._intervals: deque[float] = deque(maxlen=KEPT)

    def sent(self, now_s: float) -> None:
        """A setpoint left now."""
        if self._last_s is not None:
            self._intervals.append(now_s - self._last_s)
        self._last_s = now_s
        self.sends += 1

    def view(self) -> CadenceView:
        """Rate and jitter over the last sends; null before the second one."""
        ordered = sorted(self._intervals)
        if not ordered:
            return CadenceView(wanted_hz=self.wanted_hz, held_hz=None, p50_ms=None, p99_ms=None, max_ms=None)
        return CadenceView(
            wanted_hz=self.wanted_hz,
            held_hz=round(len(ordered) / max(sum(ordered), 1e-9), 2),
            p50_ms=_ms(ordered[len(ordered) // 2]),
            p99_ms=_ms(ordered[min(len(ordered) - 1, int(len(ordered) * 0.99))]),
            max_ms=_ms(ordered[-1]),
        )


def _ms(seconds: float) -> float:
    return round(seconds * 1e3, 2)
