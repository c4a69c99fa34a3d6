"""Runs of all sites: read from the cluster's store, commanded through their vehicle's gateway."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import Any

from app.domain.cluster.envelope import site_of
from app.domain.drop.consent import Answer
from app.domain.errors import NotFoundError
from app.domain.ports.stores import ALL_RUNS, AnswerTo, RunFilter, RunStore
from app.domain.prediction import CALM, Wind
from app.domain.run.run import Run, RunState
from app.services.plans import KnownPlans
from app.services.remote.fleet import Gateways, RemoteFleet


class RemoteRuns:
    """RunsApi and ReroutingApi of an API node."""

    def __init__(self, store: RunStore, plans: KnownPlans, fleet: RemoteFleet, gateways: Gateways) -> None:
        self._store = store
        self._plans = plans
        self._fleet = fleet
        self._gateways = gateways
        self._open_states: Mapping[RunState, int] = {}
        self._reading = asyncio.Lock()
        self._begun = 0
        self._shown: Sequence[Run] | None = None

    async def get(self, run_id: str) -> Run:
        run = await self._store.get(run_id)
        if run is None:
            raise NotFoundError(f"no run {run_id!r}", hint="list the runs to see their IDs")
        return run

    async def list_runs(self, limit: int, wanted: RunFilter = ALL_RUNS) -> Sequence[Run]:
        if wanted.older_than is not None:
            await self.get(wanted.older_than)
        return await self._store.list_runs(wanted, limit=limit)

    def open_states(self) -> Mapping[RunState, int]:
        """Of runs that were not over when `refresh` last returned."""
        return self._open_states

    async def refresh(self) -> None:
        """Count the open runs. Raises StorageError."""
        self._open_states = await self._store.open_states()

    async def open_and_recent(self, recent: int) -> Sequence[Run]:
        """See RunsApi. All sockets of a node that died ask at once: they share a read that begins after they asked."""
        begun = self._begun
        async with self._reading:
            if begun == self._begun or self._shown is None:
                self._begun, self._shown = self._begun + 1, None
                still_open = await self._store.list_runs(RunFilter(open_only=True), limit=10_000)
                newest = await self._store.list_runs(ALL_RUNS, limit=recent)
                by_id = {run.id: run for run in (*newest, *still_open)}
                self._shown = sorted(by_id.values(), key=lambda run: run.created_at, reverse=True)
            return self._shown

    async def create(
        self,
        plan: str,
        vehicle_id: str,
        *,
        start: bool,
        actor: str,
        wind: Wind = CALM,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """See RunsApi. The gateway gets the plan with the order, and no answer: the claim of its key is stored."""
        self._fleet.view(vehicle_id)
        stored = await self._plans.stored(plan)
        run: Run = await self._gateways.call(
            site_of(vehicle_id),
            "create_run",
            Run,
            plan=stored,
            vehicle_id=vehicle_id,
            start=start,
            actor=actor,
            wind=wind,
        )
        return run

    async def start(self, run_id: str) -> Run:
        return await self._call("start_run", run_id)

    async def pause(self, run_id: str) -> Run:
        return await self._call("pause_run", run_id)

    async def resume(self, run_id: str) -> Run:
        return await self._call("resume_run", run_id)

    async def return_to_launch(self, run_id: str) -> Run:
        return await self._call("return_run", run_id)

    async def divert(self, run_id: str) -> Run:
        return await self._call("divert_run", run_id)

    async def land(self, run_id: str) -> Run:
        return await self._call("land_run", run_id)

    async def abort(self, run_id: str) -> Run:
        return await self._call("abort_run", run_id)

    async def answer_consent(self, run_id: str, plan_item_id: str, answer: Answer, actor: str) -> Run:
        return await self._call("answer_consent", run_id, plan_item_id=plan_item_id, answer=answer, actor=actor)

    async def change(
        self,
        run_id: str,
        plan_id: str | None,
        continue_at: str | None,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """See ReroutingApi. The gateway gets no answer: the claim of its key is stored."""
        plan = None if plan_id is None else await self._plans.stored(plan_id)
        return await self._call("change_run", run_id, plan=plan, continue_at=continue_at, actor=actor)

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
        return await self._call("insert_items", run_id, items=items, at=at, after=after, actor=actor)

    async def continue_over(
        self,
        run_id: str,
        continue_at: str | None,
        wind: Wind | None,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        return await self._call("continue_run", run_id, continue_at=continue_at, wind=wind, actor=actor)

    async def _call(self, method: str, run_id: str, **arguments: object) -> Run:
        site = site_of((await self.get(run_id)).vehicle_id)
        run: Run = await self._gateways.call(site, method, Run, run_id=run_id, **arguments)
        return run
