"""Whether the payload has acknowledged the mission's gripper or winch item.

From the payload deliverer on board, or from a component outside. Up to v1.15 the mission waits for ACCEPTED; after a
refusal or a failure the item ends by its time-out alone.
"""

from __future__ import annotations

from app.simulator.wire import Result


class Deployment:
    """One item at a time."""

    def __init__(self) -> None:
        self.succeeded = False

    def begin(self) -> None:
        """The item's command goes out."""
        self.succeeded = False

    def hear(self, result: Result) -> None:
        """An ack addressed to the autopilot."""
        self.succeeded = result is Result.ACCEPTED
