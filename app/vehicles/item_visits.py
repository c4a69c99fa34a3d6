"""MISSION_ITEM_REACHED once per visit: PX4 repeats it about eleven times, a second apart, until another is reached."""

from __future__ import annotations

from enum import Enum, auto
from typing import Final

_SILENCE_S: Final = 3.0


class _Visit(Enum):
    TOLD = auto()
    """Reached and told; repetitions follow."""
    BACK = auto()
    """Current again after it was left: a repetition and a new arrival look alike."""
    LEFT_AGAIN = auto()
    """Left for the second time: what is said now belongs to the second visit."""


class ItemVisits:
    """Decides which REACHED is news. In doubt it waits: it may say nothing, never the same arrival twice."""

    def __init__(self) -> None:
        self._seq: int | None = None
        self._visit = _Visit.TOLD
        self._current: int | None = None
        self._last_s = 0.0

    def reset(self) -> None:
        """A new mission, a new start or a reboot: all is news again."""
        self._seq = self._current = None

    def now_current(self, seq: int) -> None:
        """MISSION_CURRENT shows `seq`."""
        if self._current == seq:
            return
        left, self._current = self._current, seq
        if self._seq is None or left is None:
            return
        if seq == self._seq:
            self._visit = _Visit.BACK
        elif left == self._seq and self._visit is _Visit.BACK:
            self._visit = _Visit.LEFT_AGAIN

    def reached(self, seq: int, now_s: float) -> bool:
        """Whether this REACHED is the first of its visit."""
        quiet_s, self._last_s = now_s - self._last_s, now_s
        news = seq != self._seq or self._visit is _Visit.LEFT_AGAIN
        news = news or (self._visit is _Visit.BACK and quiet_s > _SILENCE_S)
        if news:
            self._seq, self._visit = seq, _Visit.TOLD
        return news
