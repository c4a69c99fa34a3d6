"""How a task is flown: the one seam between the queue and the vehicle, by setpoints or by commands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from app.domain.setpoint.capability import FlightKind
from app.domain.setpoint.means import Means
from app.domain.tasks.course import Reference
from app.domain.tasks.guidance import Fix, Wish


@dataclass(frozen=True, slots=True)
class Seen:
    """Where on its course the vehicle is, and whether it has come to the end."""

    reference: Reference
    arrived: bool


class Helm(Protocol):
    """Called at every tick. Both raise SetpointRefusedError where the way leads beyond a limit or the fence."""

    @property
    def means(self) -> Means:
        """Which of the two it is."""

    def fly(self, wish: Wish, kind: FlightKind, fix: Fix, seconds: float) -> Seen:
        """On along the course; `seconds` since the last tick."""

    def stand(self, kind: FlightKind, fix: Fix) -> None:
        """Stay here; a wing circles. The place is chosen once."""

    def begin(self) -> None:
        """Something else is flown now: no place is chosen to stay at."""
