"""The face of a flight mode towards the navigator."""

from __future__ import annotations

from typing import Protocol


class FlightMode(Protocol):
    """One AUTO mode."""

    def activate(self) -> None:
        """The mode was entered."""

    def step(self) -> None:
        """One cycle while the mode is active and the vehicle armed."""
