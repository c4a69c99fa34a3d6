"""A vehicle's clock and place, sample by sample: it restarted, or two vehicles speak under one system id.

mavsdk does not show from which address a message came: two vehicles with one id look like one whose time since boot
and position jump to and fro.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final

_REORDER_MS: Final = 1000
"""Datagrams that overtake each other set the clock back by less."""
_SILENT_S: Final = 1.0
"""A vehicle that restarts is silent for longer (1.2 s of its own time); one that shares its id is not."""
_GOES_ON: Final = 5
"""So many samples behind, and none that goes on as before: the old clock has ended."""
_CERTAIN_MS: Final = 10_000
_FAR_M: Final = 50.0
_WINDOW_S: Final = 5.0
_JUMPS: Final = 4
_METRES_PER_DEG: Final = 111_320.0


class Verdict(Enum):
    """What a sample tells."""

    REBOOTED = auto()
    SUSPECT = auto()
    """Ask for AUTOPILOT_VERSION: two vehicles answer with two uids."""
    DUPLICATE = auto()


@dataclass(frozen=True, slots=True)
class Fix:
    """Where and how fast, of one GLOBAL_POSITION_INT."""

    latitude_deg: float
    longitude_deg: float
    velocity_north_m_s: float
    velocity_east_m_s: float


@dataclass(slots=True)
class Timeline:
    """Feed it each time_boot_ms, with the position where there is one."""

    boot_ms: int | None = None
    at_s: float = 0.0
    fix: Fix | None = None
    fix_boot_ms: int = 0
    behind: int = 0
    jumps_s: list[float] = field(default_factory=list)

    def take(self, boot_ms: int, now_s: float, fix: Fix | None = None) -> Verdict | None:
        """The verdict on this sample; None if it goes on as before."""
        verdict = self._clock(boot_ms, now_s)
        if fix is not None and verdict is not Verdict.REBOOTED:
            verdict = self._place(boot_ms, now_s, fix) or verdict
        if fix is not None:
            self.fix, self.fix_boot_ms = fix, boot_ms
        return verdict

    def _clock(self, boot_ms: int, now_s: float) -> Verdict | None:
        back_ms = 0 if self.boot_ms is None else self.boot_ms - boot_ms
        silent = now_s - self.at_s >= _SILENT_S
        if back_ms <= (0 if silent else _REORDER_MS):
            self.boot_ms, self.at_s, self.behind = boot_ms, now_s, 0
            return None
        self.behind += 1
        if silent or self.behind >= _GOES_ON:
            self.boot_ms, self.at_s, self.behind, self.fix = boot_ms, now_s, 0, None
            self.jumps_s.clear()
            return Verdict.REBOOTED
        return self._jumped(now_s, certain=back_ms > _CERTAIN_MS and self.behind == 1)

    def _place(self, boot_ms: int, now_s: float, fix: Fix) -> Verdict | None:
        if self.fix is None:
            return None
        passed_s = max(0.0, (boot_ms - self.fix_boot_ms) / 1e3)
        north = (fix.latitude_deg - self.fix.latitude_deg) * _METRES_PER_DEG
        east = (fix.longitude_deg - self.fix.longitude_deg) * _METRES_PER_DEG * math.cos(math.radians(fix.latitude_deg))
        speed = max(math.hypot(f.velocity_north_m_s, f.velocity_east_m_s) for f in (fix, self.fix))
        far_m = _FAR_M + 2 * speed * passed_s
        return self._jumped(now_s, certain=True) if math.hypot(north, east) > far_m else None

    def _jumped(self, now_s: float, *, certain: bool) -> Verdict:
        self.jumps_s = [at_s for at_s in self.jumps_s if now_s - at_s < _WINDOW_S]
        if certain:
            self.jumps_s.append(now_s)
        return Verdict.DUPLICATE if len(self.jumps_s) >= _JUMPS else Verdict.SUSPECT
