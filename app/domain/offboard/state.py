"""How far offboard control of a vehicle is, and what may happen to the lease that it needs."""

from __future__ import annotations

from enum import StrEnum


class OffboardState(StrEnum):
    """How far offboard control is. A vehicle in `leased` is not commanded yet."""

    IDLE = "idle"
    LEASED = "leased"
    CHECKING = "checking"
    HOLDING = "holding"
    STREAMING = "streaming"
    SWITCHING = "switching"
    ACTIVE = "active"
    LEAVING = "leaving"


class LeaseChange(StrEnum):
    """What became of a lease. The last three end it."""

    TAKEN = "taken"
    HANDED_OVER = "handed_over"
    OVERRIDDEN = "overridden"
    OFFERED = "offered"
    RELEASED = "released"
    EXPIRED = "expired"
    REVOKED = "revoked"

    @property
    def ends(self) -> bool:
        """Whether nobody has the vehicle afterwards."""
        return self in (LeaseChange.RELEASED, LeaseChange.EXPIRED, LeaseChange.REVOKED)
