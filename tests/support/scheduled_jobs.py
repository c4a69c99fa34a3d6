"""The scheduler gives jobs to vehicles, and moves nothing that is not ready, is held by somebody, or came too late."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain.offboard.state import OffboardState
from app.services.views import LeaseView, OffboardView
from tests.support.job_service import JobService

IN_YEARS = f"{datetime.now(UTC).year + 2}-01-01T00:00:00Z"
"""A time that no test reaches, and which a job may have."""


@dataclass
class Leased:
    """Offboard control of one vehicle, as the scheduler sees it."""

    view: OffboardView | None

    def view_if_used(self) -> OffboardView | None:
        return self.view

    def commanded(self, action: str) -> None:
        """It follows nothing."""


def at(service: JobService, in_s: float) -> str:
    """A time from now on the service's clock."""
    return datetime.fromtimestamp(service.clock.now() + in_s, UTC).isoformat()


def lease(vehicle_id: str, service: JobService, holder: str | None) -> None:
    """Somebody controls the vehicle in offboard mode, or nobody does any more."""
    view = OffboardView(
        state=OffboardState.LEASED,
        lease=LeaseView(holder=holder or "", expires_in_s=5.0, offered_to=None),
        reason=None,
        sent=None,
        rate=None,
        tasks=None,
    )
    service.fleet.vehicle(vehicle_id).observe(Leased(view if holder else None))
