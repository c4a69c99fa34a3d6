"""The runs of a gateway that is gone, and the other gateway of its site that goes on with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import structlog

from app.domain.cluster.envelope import site_of
from app.domain.cluster.lease import LEASE_TTL_S, Leaseholder
from app.domain.cluster.ports import LEFT_RUNS, GatewaySite, LeftRun, LeftRunDocuments
from app.domain.errors import NotFoundError
from app.domain.ports.stores import EventStore, PlanStore, RunFilter, RunStore, StoredPlan
from app.domain.run.run import Run
from app.services.fleet import Fleet
from app.services.plans import Plans
from app.services.remote.calls import Caller
from app.services.runs import Runs

log = structlog.get_logger(__name__)

SILENT_S: Final = LEASE_TTL_S
MOST_RUNS: Final = 1000


class SiteHandover:
    """Handover of a gateway. `system_id` is its own as a ground station."""

    def __init__(
        self, part: GatewaySite, system_id: int, fleet: Fleet, runs: Runs, plans: Plans, caller: Caller
    ) -> None:
        self._part = part
        self._system_id = system_id
        self._fleet = fleet
        self._runs = runs
        self._plans = plans
        self._caller = caller

    def is_silent(self, holder: Leaseholder) -> bool:
        """See Handover."""
        if holder.system_id in (0, self._system_id):  # its HEARTBEAT could not be told from ours
            return False
        links = [vehicle.link for vehicle in self._fleet.each()]
        ages_s = [link.ground_station_age_s(holder.system_id) for link in links if link.state().connected]
        return len(ages_s) == len(links) > 0 and all(age_s is not None and age_s >= SILENT_S for age_s in ages_s)

    async def runs_left(self) -> Sequence[LeftRun]:
        """See Handover."""
        site, known = self._part.site, [run.id for run in self._runs.open_runs()]
        found: list[LeftRun] = await self._caller.call(
            LEFT_RUNS, LEFT_RUNS, "left_runs", list[LeftRun], "", site=site, gateway=self._part.gateway, known=known
        )
        return found

    async def take_over(self, left: LeftRun) -> None:
        """See Handover."""
        found: LeftRunDocuments = await self._caller.call(
            LEFT_RUNS, LEFT_RUNS, "left_run", LeftRunDocuments, "", run_id=left.run_id
        )
        log.warning("a run of another gateway goes on here", run_id=left.run_id, gateway=left.gateway)
        for plan in found.plans:
            await self._plans.adopt(plan)
        await self._runs.take_over(found.run, by=self._part.gateway, of=left.gateway)


class LeftRunCalls:
    """What gateways ask of the cluster's store: each public method is a call."""

    def __init__(self, runs: RunStore, plans: PlanStore, events: EventStore) -> None:
        self._runs = runs
        self._plans = plans
        self._events = events

    async def left_runs(self, site: str, gateway: str, known: list[str]) -> list[LeftRun]:
        """The open runs of the site that another gateway follows, and those of `known` that one has ended."""
        found = await self._runs.list_runs(RunFilter(open_only=True), limit=MOST_RUNS)
        runs = {run.id: run for run in found if site_of(run.vehicle_id) == site}
        for run_id in known:
            if run_id not in runs and (run := await self._runs.get(run_id)) is not None:
                runs[run_id] = run
        left = [LeftRun(run_id=run.id, gateway=await self._follower(run), is_over=run.is_over) for run in runs.values()]
        return [run for run in left if run.gateway != gateway]

    async def left_run(self, run_id: str) -> LeftRunDocuments:
        """One run, with its plans. Raises NotFoundError."""
        run = await self._runs.get(run_id)
        if run is None:
            raise NotFoundError(f"no run {run_id!r}")
        return LeftRunDocuments(run=run, plans=await self._plans_of(run))

    async def _follower(self, run: Run) -> str:
        if run.taken_over is not None:
            return run.taken_over.gateway
        first = await self._events.read(after=0, limit=1, run_id=run.id)
        return first[0].gateway if first else ""

    async def _plans_of(self, run: Run) -> tuple[StoredPlan, ...]:
        ids = {run.plan_id} if run.changing is None else {run.plan_id, run.changing.plan_id}
        found = [await self._plans.get(plan_id) for plan_id in ids]
        return tuple([plan for plan in found if plan is not None])
