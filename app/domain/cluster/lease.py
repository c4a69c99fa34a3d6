"""The lease of a site's name: which gateway may begin new work under it. It ends no run and moves no vehicle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.errors import ConflictError, WaydropError
from app.domain.model import Frozen

LEASE_TTL_S: Final = 5.0
"""A lease that is not renewed for so long can be taken by another gateway."""
RENEWED_EVERY_S: Final = 1.0


class SiteTakenError(ConflictError, code="cluster.site_taken"):
    """Another gateway holds the lease of this site's name. `extra["holder"]` is that gateway."""


class SiteUndecidedError(WaydropError, code="cluster.site_undecided"):
    """It is not known whether another gateway holds the lease."""


class Leaseholder(Frozen):
    """`gateway` is the id of its journal. `address` differs for copies of one journal: the machine and the folder.

    `system_id` is its MAVLink system id as a ground station, 0 if that is not known. `has_standby`: it commands nothing
    once it may have been taken over.
    """

    gateway: str
    address: str
    system_id: int = 0
    has_standby: bool = False

    def is_same(self, other: Leaseholder) -> bool:
        """Whether it is the same gateway in the same place."""
        return (self.gateway, self.address) == (other.gateway, other.address)


class LeaseState(StrEnum):
    """What a gateway knows of the lease of its site."""

    UNDECIDED = "undecided"
    """The gateway has just started, or stood still for longer than the lease lasts: another one may have its site."""
    ALONE = "alone"
    """The lease cannot be read or written: the gateway works as without a cluster."""
    HELD = "held"
    TAKEN = "taken"
    """Another gateway holds it."""
    EXPIRED = "expired"
    """Another gateway held it and did not give it up: that one may still command its vehicles."""


@dataclass(frozen=True, slots=True)
class SiteClaim:
    """What a gateway knows. HELD or ALONE until `until_s` (monotonic); TAKEN by `holder`, or EXPIRED."""

    state: LeaseState = LeaseState.UNDECIDED
    until_s: float = math.inf
    holder: Leaseholder | None = None

    @classmethod
    def held(cls, *, sent_s: float) -> SiteClaim:
        """The lease was written; the writing began at `sent_s`, so the server's time to live ends later."""
        return cls(LeaseState.HELD, until_s=sent_s + LEASE_TTL_S)

    @classmethod
    def taken(cls, holder: Leaseholder) -> SiteClaim:
        """Another gateway holds the lease."""
        return cls(LeaseState.TAKEN, holder=holder)

    @classmethod
    def expired(cls, holder: Leaseholder) -> SiteClaim:
        """The lease of another gateway has expired."""
        return cls(LeaseState.EXPIRED, holder=holder)

    def unanswered(self, now_s: float, *, has_standby: bool) -> SiteClaim:
        """The lease could be neither read nor written. That another gateway has it stays true until it is disproved.

        With a standby, being alone has to be confirmed all the time: after a gap the standby may have taken over.
        """
        if self.holder is not None or (has_standby and self.state is LeaseState.UNDECIDED):
            return self
        return SiteClaim(LeaseState.ALONE, until_s=now_s + LEASE_TTL_S if has_standby else math.inf)

    def at(self, now_s: float) -> SiteClaim:
        """What was not confirmed in time is no longer known."""
        return self if now_s < self.until_s else SiteClaim()

    def is_copied(self, gateway: str) -> bool:
        """Whether the holder has a copy of this gateway's journal, and so follows the same runs."""
        return self.holder is not None and self.holder.gateway == gateway

    def may_relay(self, gateway: str) -> bool:
        """Whether the journal may be sent to the cluster. Of two copies of a journal, only the holder's is."""
        return self.state is not LeaseState.UNDECIDED and not self.is_copied(gateway)

    def why_no_new_work(self, site: str) -> WaydropError | None:
        """Why no upload, start or offboard control may begin; None: it may."""
        match self.state:
            case LeaseState.TAKEN:
                holder = None if self.holder is None else self.holder.gateway
                return SiteTakenError(
                    f"another gateway ({holder}) has the site {site}",
                    hint="give each gateway its own WAYDROP_SITE, and stop the one that does not belong to this site. "
                    "Runs in flight go on; hold, return and land are always sent",
                    holder=holder,
                )
            case LeaseState.EXPIRED:
                holder = None if self.holder is None else self.holder.gateway
                return SiteTakenError(
                    f"the gateway {holder} had the site {site}, is not heard, and may still command its vehicles",
                    hint="start it again. If it is switched off, let this gateway take over: `waydrop take-over`",
                    holder=holder,
                )
            case LeaseState.UNDECIDED:
                return SiteUndecidedError(
                    f"it is not known yet whether another gateway has the site {site}", hint="wait a few seconds"
                )
            case LeaseState.ALONE | LeaseState.HELD:
                return None
