"""The runs of a gateway that is gone, and the other gateway of its site that goes on with them."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

import structlog

from app.domain.cluster.envelope import site_of
from app.domain.cluster.lease import LEASE_TTL_S, RENEWED_EVERY_S, Leaseholder
from app.domain.cluster.ports import LEFT_RUNS, GatewaySite, Handover, LeftRun, LeftRunDocuments
from app.domain.errors import NotFoundError, WaydropError
from app.domain.ports.stores import EventStore, PlanStore, RunFilter, RunStore, StoredPlan
from app.domain.run.run import Run
from app.services.fleet import Fleet
from app.services.plans import Plans
from app.services.remote.calls import Caller, CallFunctions
from app.services.runs import Runs

log = structlog.get_logger(__name__)

SILENT_S: Final = LEASE_TTL_S + RENEWED_EVERY_S
"""Without NATS a gateway finds every RENEWED_EVERY_S that it is alone, and commands for LEASE_TTL_S after that, even if
it stood still meanwhile."""
FORWARDED_S: Final = LEASE_TTL_S + 3.0
"""HEARTBEATs come every second. If none came for so long before the lease was last seen held, they are not forwarded
any more. It was written up to LEASE_TTL_S before that."""
CALL_S: Final = 2.0
"""A takeover does not wait for an API node that is slow: it asks again."""
OWN_AGAIN: Final = 2
"""The number that is one higher is that of the gateway which may have taken the run over."""
PAGE_RUNS: Final = 1000
AGAIN_S: Final = 1.0
"""What could not be taken over is tried again so much later."""
ASKED_AGAIN_S: Final = 30.0


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

    def is_silent(self, holder: Leaseholder, left: Sequence[LeftRun], held_age_s: float) -> bool:
        if holder.system_id in (0, self._system_id):  # its HEARTBEAT could not be told from ours
            return False
        heard = {one.id: one.link for one in self._fleet.each() if one.link.state().connected}
        flown = {run.vehicle_id for run in left if not run.is_over}
        flown |= {run.vehicle_id for run in self._runs.open_runs() if not run.is_over}
        if not heard or not flown <= heard.keys():
            return False
        ages_s = [link.ground_station_age_s(holder.system_id) for link in heard.values()]
        return all(age_s is not None and SILENT_S <= age_s <= held_age_s + FORWARDED_S for age_s in ages_s)

    def has_lost_a_vehicle(self) -> bool:
        return any(not vehicle.link.state().connected for vehicle in self._fleet.each())

    async def runs_left(self) -> Sequence[LeftRun]:
        site, known = self._part.site, [run.id for run in self._runs.open_runs()]
        found: list[LeftRun] = await self._caller.call(
            LEFT_RUNS,
            LEFT_RUNS,
            "left_runs",
            list[LeftRun],
            "",
            CALL_S,
            site=site,
            gateway=self._part.gateway,
            known=known,
        )
        return [run for run in found if run.number >= await self._number_here(run.run_id)]

    async def _number_here(self, run_id: str) -> int:
        try:
            return (await self._runs.get(run_id)).handovers
        except NotFoundError:
            return 0

    async def take_over(self, left: LeftRun) -> None:
        found: LeftRunDocuments = await self._caller.call(
            LEFT_RUNS, LEFT_RUNS, "left_run", LeftRunDocuments, "", CALL_S, run_id=left.run_id
        )
        log.warning("a run of another gateway goes on here", run_id=left.run_id, gateway=left.gateway)
        for plan in found.plans:
            await self._plans.adopt(plan)
        if found.run.handovers >= await self._number_here(left.run_id):
            await self._runs.take_over(found.run, by=self._part.gateway, of=left.gateway)

    async def reclaim(self, of: str, left: Sequence[LeftRun]) -> None:
        others = {run.run_id for run in left}
        for run in tuple(self._runs.open_runs()):
            if run.id not in others and not run.is_over:
                log.warning("another gateway may have followed a run of this one", run_id=run.id, gateway=of)
                await self._runs.take_over(run, by=self._part.gateway, of=of, number=run.handovers + OWN_AGAIN)


class HandoverQueue:
    """The runs that are to be taken over, one after the other: one that fails does not hold up the others."""

    def __init__(self, handover: Handover) -> None:
        self._handover = handover
        self._left: deque[LeftRun] = deque()
        self._untried: set[str] = set()
        self._asks_again = False
        self._filled = asyncio.Event()

    @property
    def is_untried(self) -> bool:
        """Whether there are runs that nobody has tried to take over yet."""
        return bool(self._untried)

    @property
    def run_ids(self) -> Sequence[str]:
        """The runs that are not taken over yet."""
        return tuple(run.run_id for run in self._left)

    def expect(self, left: Sequence[LeftRun]) -> None:
        """These are left, and more may be. Those that wait already keep their places."""
        self._asks_again = True
        waiting = {run.run_id for run in self._left}
        new = [run for run in left if run.run_id not in waiting]
        self._left.extendleft(reversed(new))
        self._untried |= {run.run_id for run in new}
        if self._left:
            self._filled.set()

    async def work(self, may_take: Callable[[], bool]) -> None:
        """Take runs over while `may_take`, until cancelled. Runs that arrive late are asked for again."""
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(ASKED_AGAIN_S):
                    await self._filled.wait()
            is_allowed = may_take()
            if is_allowed:
                await (self._take_one() if self._left else self._ask_again())
            if not is_allowed or not self._untried:
                await asyncio.sleep(AGAIN_S)

    async def _take_one(self) -> None:
        left = self._left[0]
        try:
            await self._handover.take_over(left)
        except NotFoundError:
            log.warning("a run that was left is not in the store any more", run_id=left.run_id)
            self._left.remove(left)
        except WaydropError as error:
            log.error("a run cannot be taken over yet", run_id=left.run_id, error=error.detail)
            self._left.remove(left)
            self._left.append(left)
        else:
            self._left.remove(left)
        self._untried.discard(left.run_id)
        if not self._left:
            self._filled.clear()

    async def _ask_again(self) -> None:
        if self._asks_again:
            with suppress(WaydropError):
                self.expect(await self._handover.runs_left())


class LeftRunCalls:
    """What gateways ask of the cluster's store."""

    def __init__(self, runs: RunStore, plans: PlanStore, events: EventStore) -> None:
        self._runs = runs
        self._plans = plans
        self._events = events

    def functions(self) -> CallFunctions:
        """By the names of the calls."""
        return {"left_runs": self.left_runs, "left_run": self.left_run}

    async def left_runs(self, site: str, gateway: str, known: list[str]) -> list[LeftRun]:
        """The open runs of the site that another gateway follows, and those of `known` that one has ended."""
        runs = {run.id: run for run in await self._open_runs() if site_of(run.vehicle_id) == site}
        for run_id in known:
            if run_id not in runs and (run := await self._runs.get(run_id)) is not None:
                runs[run_id] = run
        followers = {run.id: await self._follower(run) for run in runs.values()}
        return [
            LeftRun(
                run_id=run.id,
                vehicle_id=run.vehicle_id,
                gateway=followers[run.id],
                is_over=run.is_over,
                number=run.handovers,
            )
            for run in runs.values()
            if followers[run.id] != gateway
        ]

    async def left_run(self, run_id: str) -> LeftRunDocuments:
        """One run, with its plans. Raises NotFoundError."""
        run = await self._runs.get(run_id)
        if run is None:
            raise NotFoundError(f"no run {run_id!r}")
        return LeftRunDocuments(run=run, plans=await self._plans_of(run))

    async def _open_runs(self) -> Sequence[Run]:
        found: list[Run] = []
        while page := await self._runs.list_runs(
            RunFilter(open_only=True, older_than=found[-1].id if found else None), limit=PAGE_RUNS
        ):
            found += page
        return found

    async def _follower(self, run: Run) -> str:
        if run.taken_over is not None:
            return run.taken_over.gateway
        first = await self._events.read(after=0, limit=1, run_id=run.id)
        return first[0].gateway if first else ""

    async def _plans_of(self, run: Run) -> tuple[StoredPlan, ...]:
        ids = {run.plan_id} if run.changing is None else {run.plan_id, run.changing.plan_id}
        found = [await self._plans.get(plan_id) for plan_id in ids]
        return tuple([plan for plan in found if plan is not None])
