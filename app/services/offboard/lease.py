"""The lease: the exclusive, expiring right of one client to fly one vehicle by hand."""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass, replace

from app.domain.errors import LeaseHeldError, LeaseLostError
from app.services.offboard_view import LeaseView


@dataclass(frozen=True, slots=True)
class Lease:
    """`id` is the holder's secret. `expires_s` is monotonic. `offered_to` may take it over."""

    id: str
    vehicle_id: str
    holder: str
    expires_s: float
    offered_to: str | None = None

    def view(self, now_s: float) -> LeaseView:
        """What everybody may see of it."""
        left_s = round(max(0.0, self.expires_s - now_s), 1)
        return LeaseView(holder=self.holder, expires_in_s=left_s, offered_to=self.offered_to)


@dataclass(slots=True)
class LeaseSlot:
    """Room for one lease of one vehicle."""

    vehicle_id: str
    lease_s: float
    lease: Lease | None = None

    def take(self, holder: str, now_s: float, *, override: bool) -> Lease:
        """A new lease, in the place of one that has ended, was offered to `holder`, or is overridden.

        Raises:
            LeaseHeldError: another client has it.
        """
        held = self.lease
        if held is not None and now_s < held.expires_s and not override and held.offered_to != holder:
            raise LeaseHeldError(
                f"{held.holder} has the offboard lease of vehicle {self.vehicle_id}",
                hint="wait until it ends, ask for a hand-over, or let an admin override it",
                holder=held.holder,
                expires_in_s=round(held.expires_s - now_s, 1),
            )
        self.lease = Lease(f"lease-{secrets.token_urlsafe(16)}", self.vehicle_id, holder, now_s + self.lease_s)
        return self.lease

    def require(self, lease_id: str, now_s: float) -> Lease:
        """The lease with this id, renewed. Raises LeaseLostError for any other."""
        self.lease = replace(self.check(lease_id, now_s), expires_s=now_s + self.lease_s)
        return self.lease

    def check(self, lease_id: str, now_s: float) -> Lease:
        """The lease with this id, as it is. Raises LeaseLostError for any other."""
        held = self.lease
        if held is None or now_s >= held.expires_s or not hmac.compare_digest(held.id.encode(), lease_id.encode()):
            raise LeaseLostError(
                f"no such lease of vehicle {self.vehicle_id}, or it has ended",
                hint="take the lease again, then enter again",
            )
        return held

    def offer(self, lease_id: str, to: str | None, now_s: float) -> Lease:
        """Let `to` take the lease over; None takes the offer back. Raises LeaseLostError."""
        self.lease = replace(self.require(lease_id, now_s), offered_to=to)
        return self.lease

    def has_expired(self, now_s: float) -> bool:
        """Whether there is a lease and its time is over."""
        return self.lease is not None and now_s >= self.lease.expires_s
