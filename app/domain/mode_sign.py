"""Who commanded the mode a vehicle is in, as far as its messages tell.

A mode and its failsafe come together, in a HEARTBEAT or in a CURRENT_MODE (by the intended mode; without it the
failsafe comes with the next HEARTBEAT). MISSION_CURRENT (the plan's own return or end) comes up to a second before or
after: nobody is named before all of them have had time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from app.domain.vehicle import FlightMode, VehicleState

CAUSE_TOLD_S: Final = 2.5
"""HEARTBEAT and MISSION_CURRENT come at 1 Hz, and one may be lost."""


@dataclass(frozen=True, slots=True)
class ModeSign:
    """`since_s`: when this mode was first seen; `by_failsafe`: one was seen in it, also if it has ended since."""

    mode: FlightMode | None = None
    since_s: float = 0.0
    by_failsafe: bool = False

    def seen(self, state: VehicleState, now_s: float) -> ModeSign:
        """The sign after a look at a connected vehicle."""
        if state.mode is not self.mode:
            return ModeSign(state.mode, now_s, state.in_failsafe)
        return replace(self, by_failsafe=True) if state.in_failsafe and not self.by_failsafe else self

    def is_settled(self, now_s: float) -> bool:
        """Whether what would tell of the mode's cause has had its time."""
        return now_s - self.since_s > CAUSE_TOLD_S
