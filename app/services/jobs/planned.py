"""The plans of jobs, read once from the store and kept a while."""

from __future__ import annotations

from collections import OrderedDict
from typing import Final

from app.domain.plan import Plan, parse_plan
from app.services.plans import Plans

KEPT: Final = 64


class PlannedJobs:
    """A plan never changes, so it is parsed once."""

    def __init__(self, plans: Plans) -> None:
        self._plans = plans
        self._kept: OrderedDict[str, Plan] = OrderedDict()

    async def plan(self, plan_id: str) -> Plan:
        """One plan. Raises NotFoundError, PlanInvalid (another version accepted it), StorageError."""
        plan = self._kept.get(plan_id) or parse_plan((await self._plans.stored(plan_id)).document)
        self._kept[plan_id] = plan
        self._kept.move_to_end(plan_id)
        if len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        return plan
