"""Requests that change where a run flies, or continue one that has ended, converted to stored plans."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from functools import partial
from typing import Any

from app.domain.errors import ChangeUnderWayError
from app.domain.plan import Plan
from app.domain.ports.stores import AnswerTo
from app.domain.ports.threads import InThread
from app.domain.prediction import CALM, Wind
from app.domain.run.mission_change import with_items
from app.domain.run.remaining_mission import tail_of
from app.domain.run.run import Run
from app.services.plans import Plans
from app.services.runs import Runs


class Rerouting:
    """A plan that results is stored and recorded like any other, in one step with the run that flies it.

    A rejected request stores no plan. `answer`: that to the request, stored in the same step.
    """

    def __init__(self, runs: Runs, plans: Plans, in_thread: InThread = asyncio.to_thread) -> None:
        self._runs = runs
        self._plans = plans
        self._in_thread = in_thread

    async def change(
        self,
        run_id: str,
        plan_id: str | None,
        continue_at: str | None,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Fly on with another plan, or with the run's own, from an item. Raises as Runs.change_mission."""
        if plan_id is None:
            plan_id = (await self._runs.get(run_id)).plan_id
        return await self._runs.change_mission(run_id, plan_id, continue_at, actor, answer=answer)

    async def insert(
        self,
        run_id: str,
        items: Sequence[Any],
        *,
        at: str,
        after: bool,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Fly to more items, before or after a stop that is still to come.

        Raises:
            NotFoundError, PlanInvalid, PlanRejectedError: the flight is past that place, or the plan has errors.
            ChangeUnderWayError: also if the run got another plan meanwhile. Others as Runs.change_mission.
        """
        before = await self._runs.get(run_id)
        old = await self._plans.plan(before.plan_id)
        plan, new_ids = await self._in_thread(partial(with_items, old, items, at=at, after=after))
        new = await self._plans.checked(plan, actor)
        run = await self._runs.get(run_id)
        if run.plan_id != before.plan_id:  # otherwise the items of that change would be removed again
            raise ChangeUnderWayError("the plan was changed meanwhile", hint="order it again")
        begins = new_ids[0] if _comes_next(plan, new_ids, run.item_id) else None
        return await self._runs.change_mission(run_id, new, begins, actor, needed=new_ids, answer=answer)

    async def continue_over(
        self,
        run_id: str,
        continue_at: str | None,
        wind: Wind | None,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Create a run of the remaining items of one that has ended; it does not start automatically. `wind` None: as
        before.

        Raises:
            NotFoundError, RunNotOverError, RunContinuedError, NoRemainingItemsError, PlanRejectedError, ConflictError,
            VehicleBusyError, VehicleQuarantinedError, LinkError, StorageError.
        """
        run = await self._runs.continuable(run_id)
        self._runs.require_free(run.vehicle_id)
        new = await self._plans.checked(tail_of(run, await self._plans.plan(run.plan_id), continue_at), actor)
        wind = wind or run.wind or CALM
        return await self._runs.create(
            new, run.vehicle_id, start=False, actor=actor, wind=wind, continues=run_id, answer=answer
        )


def _comes_next(plan: Plan, new_ids: Sequence[str], current: str | None) -> bool:
    """Whether the new items stand right before the item that is flown now."""
    last = plan.index_of(new_ids[-1])
    return last is not None and last + 1 < len(plan.items) and plan.items[last + 1].id == current
