"""The lease, made and shown."""

from __future__ import annotations

import secrets

from app.domain.offboard.state import Lease
from app.services.offboard_view import LeaseView


def new_lease(vehicle_id: str, holder: str, expires_s: float) -> Lease:
    """A lease that nobody can guess."""
    return Lease(f"lease-{secrets.token_urlsafe(16)}", vehicle_id, holder, expires_s)


def view_of(lease: Lease, now_s: float) -> LeaseView:
    """What everybody may see of it."""
    left_s = round(max(0.0, lease.expires_s - now_s), 1)
    return LeaseView(holder=lease.holder, expires_in_s=left_s, offered_to=lease.offered_to)
