"""The dead-man: what may be sent when the client has been silent for so long."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from app.domain.setpoint.capability import FlightKind


class Silence(StrEnum):
    """How silent the client is, and so what is sent at a tick."""

    SPEAKS = "speaks"
    """Its newest setpoint is fresh: send it."""
    SILENT = "silent"
    """Send a velocity of zero."""
    GONE = "gone"
    """Command Hold, send nothing any more, end the lease."""


@dataclass(frozen=True, slots=True)
class DeadMan:
    """`max_age_s`: a setpoint older than this is never sent. `gone_s`: then the client counts as gone."""

    max_age_s: float = 0.4
    gone_s: float = 1.0

    def judge(self, age_s: float, kind: FlightKind, *, has_estimate: bool = True) -> Silence:
        """The stage at this age of the newest setpoint. What cannot stand still is given up at once."""
        if age_s <= self.max_age_s:
            return Silence.SPEAKS
        waits = can_stand(kind) and has_estimate and age_s < self.gone_s
        return Silence.SILENT if waits else Silence.GONE


def can_stand(kind: FlightKind) -> bool:
    """Whether a velocity of zero makes it stand still."""
    return kind in (FlightKind.ROTARY, FlightKind.ROVER)
