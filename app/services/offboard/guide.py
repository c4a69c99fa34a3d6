"""Who may speak for the client of a lease between its words: the guidance of its tasks."""

from __future__ import annotations

from typing import Protocol

from app.services.offboard_view import TaskReport


class Guide(Protocol):
    """Called on the event loop by the vehicle's offboard control."""

    def tick(self, now_s: float) -> None:
        """Before each send: give a setpoint, or none."""

    def overruled(self) -> None:
        """The client has put a setpoint itself."""

    def left(self) -> None:
        """The client wants to leave: nothing is guided any more, even if that fails, until the client says so."""

    def report(self) -> TaskReport | None:
        """What is shown with the state; None if no task was ever queued."""
