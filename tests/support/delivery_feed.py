"""A store of one plan that fails as often as a test says."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.errors import StorageError
from app.domain.ports.stores import StoredPlan
from app.domain.vehicle.state import VehicleType

PLAN = StoredPlan("plan-1", "ab", "clinic", VehicleType.MULTICOPTER, 1.0, "desk", {"order": {"id": "RX-1"}})


class Plans:
    """PlanStore of one plan, on a disk that fails for as often as it is told."""

    def __init__(self, failures: int = 0) -> None:
        self.failures = failures

    async def get(self, plan_id: str) -> StoredPlan | None:
        if self.failures:
            self.failures -= 1
            raise StorageError("the disk failed to read or write")
        return PLAN if plan_id == PLAN.id else None

    async def list_plans(self, *, limit: int, older_than: str | None = None) -> Sequence[StoredPlan]:
        return [PLAN]
