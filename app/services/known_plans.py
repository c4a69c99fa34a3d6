"""Accepted plans, each parsed once and kept a while: a plan never changes."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Sequence
from typing import Final

from app.domain.errors import NotFoundError
from app.domain.plan import Plan, parse_plan
from app.domain.ports import PlanStore, StoredPlan

KEPT: Final = 64


class KnownPlans:
    """The plans of the store, and what they say."""

    def __init__(self, store: PlanStore) -> None:
        self._store = store
        self._kept: OrderedDict[str, Plan] = OrderedDict()

    async def stored(self, plan_id: str) -> StoredPlan:
        """One plan as it was accepted, neither checked anew nor predicted. Raises NotFoundError, StorageError."""
        stored = await self._store.get(plan_id)
        if stored is None:
            raise NotFoundError(f"no plan {plan_id!r}", hint="GET /api/v1/plans lists them")
        return stored

    async def plan(self, plan_id: str) -> Plan:
        """One plan. Raises NotFoundError, PlanInvalid (another version accepted it), StorageError."""
        if (plan := self._kept.get(plan_id)) is None:
            return await self.read(await self.stored(plan_id))
        self._kept.move_to_end(plan_id)
        return plan

    async def read(self, stored: StoredPlan) -> Plan:
        """What a stored plan says. Raises PlanInvalid."""
        plan = self._kept.get(stored.id)
        if plan is None:
            plan = await asyncio.to_thread(parse_plan, stored.document)
        self.keep(stored.id, plan)
        return plan

    def keep(self, plan_id: str, plan: Plan) -> None:
        """It was parsed just now."""
        self._kept[plan_id] = plan
        self._kept.move_to_end(plan_id)
        if len(self._kept) > KEPT:
            self._kept.popitem(last=False)

    async def list_plans(self, limit: int) -> Sequence[StoredPlan]:
        """Newest first. Raises StorageError."""
        return await self._store.list_plans(limit=limit)
