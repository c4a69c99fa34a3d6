"""Looks at vehicles for a plan: each with its own parameters and state, by the full rule set."""

from __future__ import annotations

import asyncio
import math
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from app.domain.errors import WaydropError
from app.domain.jobs.assignment import (
    VehicleReadiness,
    beginning_of,
    choose,
    distance_to,
    why_not_ready,
    why_not_selected,
    why_not_trusted,
    why_unfit,
    why_unseen,
)
from app.domain.jobs.job import MOST_REFUSALS, Candidate, Refusal, VehicleRefusal, VehicleSelector
from app.domain.plan import Plan, plan_hash
from app.domain.prediction import CALM, Wind
from app.domain.rules import Finding
from app.domain.vehicle.clock import is_too_fast
from app.domain.vehicle.state import VehicleProfile
from app.services.background import end_tasks
from app.services.fleet import Fleet
from app.services.jobs.time_slice import TimeSlice
from app.services.plan_checks import rules_at_best
from app.services.plan_work import PlanWork

KEPT: Final = 1024
"""Findings of plan and vehicle. They are the same until the vehicle's facts are others."""

ASKED_AT_ONCE: Final = 4
"""Vehicles whose facts are requested in one turn of the loop: collecting the facts of a vehicle takes time."""


@dataclass(frozen=True, slots=True)
class _Checked:
    """`at_best`: see why_unfit."""

    facts: VehicleProfile
    findings: tuple[Finding, ...]
    at_best: frozenset[str]


class Assessment:
    """Sends no commands. Parameters are read from a vehicle once, and again after a reboot; the link caches them.

    A vehicle that is slow to report them counts as silent, and a task continues to read them without blocking the
    others.
    """

    def __init__(self, fleet: Fleet, facts_s: float, work: PlanWork) -> None:
        self._fleet = fleet
        self._work = work
        self._facts_s = facts_s
        self._checked: OrderedDict[tuple[str, Wind, str], _Checked] = OrderedDict()
        self._asking: dict[str, asyncio.Task[VehicleProfile]] = {}
        self._silent_since_s: dict[str, float] = {}
        self._late: set[str] = set()
        self._answered: Callable[[], None] = lambda: None

    def on_late_answer(self, tell: Callable[[], None]) -> None:
        """From now on `tell` is called once a vehicle reports its facts that did not do so in time."""
        self._answered = tell

    def is_awaited(self, candidate: Candidate) -> bool:
        """Whether its facts alone are missing, and have been asked for no longer than it may take to report them."""
        since_s = self._silent_since_s.get(candidate.vehicle_id)
        is_silent = [refusal.code for refusal in candidate.refusals] == [VehicleRefusal.SILENT.value]
        return is_silent and since_s is not None and _now_s() - since_s < self._facts_s

    async def close(self) -> None:
        """Ask no further. Idempotent."""
        await end_tasks(*self._asking.values())

    async def candidates(
        self,
        plan: Plan,
        selector: VehicleSelector,
        vehicles: Sequence[VehicleReadiness],
        wind: Wind = CALM,
        facts_s: float | None = None,
    ) -> tuple[Candidate, ...]:
        """All vehicles of the fleet, and those that the selector names and that never connected; one may be chosen.

        The rules use the wind. `facts_s`: a shorter time limit for vehicles to report their facts; one that was late
        before is not waited for again.
        """
        key = (await asyncio.to_thread(plan_hash, plan), wind)
        seen = {vehicle.vehicle_id for vehicle in vehicles}
        asked = await self._ask(
            [
                vehicle.vehicle_id
                for vehicle in vehicles
                if selector.allows(vehicle.vehicle_id) and vehicle.state.connected
            ],
            facts_s,
        )
        time_slice, found = TimeSlice(), []
        for vehicle in vehicles:
            distrust = () if selector.named else why_not_trusted(vehicle, vehicles)
            found.append(await self._candidate(key, plan, selector, vehicle, asked.get(vehicle.vehicle_id), distrust))
            await time_slice.take()
        return choose([*found, *(_unseen(name) for name in selector.named if name not in seen)])

    async def _candidate(
        self,
        key: tuple[str, Wind],
        plan: Plan,
        selector: VehicleSelector,
        vehicle: VehicleReadiness,
        asked: asyncio.Task[VehicleProfile] | None,
        distrust: Sequence[Refusal],
    ) -> Candidate:
        state = vehicle.state
        not_selected = why_not_selected(vehicle.vehicle_id, state.battery_percent, selector)
        refusals = [*why_not_ready(vehicle), *not_selected, *distrust]
        if asked is not None:
            refusals += await self._unfit(key, plan, vehicle.vehicle_id, asked, we_choose=selector.is_any)
        return Candidate(
            vehicle_id=vehicle.vehicle_id,
            distance_m=distance_to(beginning_of(plan), state),
            battery_percent=state.battery_percent,
            refusals=tuple(refusals[:MOST_REFUSALS]),
            omitted_refusals=max(0, len(refusals) - MOST_REFUSALS),
            permanent=any(refusal.permanent for refusal in refusals),
        )

    async def _unfit(
        self,
        key: tuple[str, Wind],
        plan: Plan,
        vehicle_id: str,
        asked: asyncio.Task[VehicleProfile],
        *,
        we_choose: bool,
    ) -> Sequence[Refusal]:
        if not asked.done():
            message = "the parameters are still being read"
            return [Refusal(code=VehicleRefusal.SILENT.value, message=message, hint="wait a moment")]
        try:
            facts = asked.result()
        except WaydropError as error:
            return [
                Refusal(code=VehicleRefusal.SILENT.value, message=error.detail, hint=error.hint or "check its link")
            ]
        checked = await self._check(key, plan, vehicle_id, facts)
        return why_unfit(checked.findings, we_choose=we_choose, at_best=checked.at_best)

    async def _ask(
        self, vehicle_ids: Sequence[str], facts_s: float | None
    ) -> Mapping[str, asyncio.Task[VehicleProfile]]:
        """Ask these for their facts, a few in each turn of the loop, and wait for all of them together.

        One that has not answered in time is asked on.
        """
        time_slice, asked = TimeSlice(), dict[str, asyncio.Task[VehicleProfile]]()
        for vehicle_id in vehicle_ids:
            asked[vehicle_id] = self._asking.get(vehicle_id) or self._begin_to_ask(vehicle_id)
            if len(asked) % ASKED_AT_ONCE == 0:
                await time_slice.give()
        waited = [task for vehicle_id, task in asked.items() if facts_s is None or vehicle_id not in self._late]
        if waited:
            await asyncio.wait(waited, timeout=self._facts_s if facts_s is None else facts_s)
        for vehicle_id, task in asked.items():
            if not task.done():
                self._late.add(vehicle_id)
            elif self._asking.get(vehicle_id) is task:
                del self._asking[vehicle_id]
        return asked

    def _begin_to_ask(self, vehicle_id: str) -> asyncio.Task[VehicleProfile]:
        task = asyncio.create_task(self._fleet.facts(vehicle_id), name=f"facts {vehicle_id}")
        self._asking[vehicle_id] = task
        self._silent_since_s.setdefault(vehicle_id, _now_s())
        task.add_done_callback(lambda done: self._take_answer(vehicle_id, done))
        return task

    def _take_answer(self, vehicle_id: str, task: asyncio.Task[VehicleProfile]) -> None:
        was_late = vehicle_id in self._late
        self._late.discard(vehicle_id)
        if task.cancelled() or task.exception() is not None:
            return
        self._silent_since_s.pop(vehicle_id, None)
        if was_late:
            self._answered()

    async def _check(self, key: tuple[str, Wind], plan: Plan, vehicle_id: str, facts: VehicleProfile) -> _Checked:
        rate = facts.least_clock_rate  # measured anew each moment, and only this of it matters to the rules
        charge = facts.battery_percent  # in whole per cent, for the same reason
        facts = replace(facts, battery_percent=None if charge is None else math.floor(charge))
        alike = replace(facts, least_clock_rate=1.0 if rate is None or not is_too_fast(rate) else 1e3)
        known = self._checked.get((*key, vehicle_id))
        if known is None or known.facts != alike:
            findings, at_best = await self._work.run(plan, rules_at_best, plan, facts, key[1])
            known = self._checked[(*key, vehicle_id)] = _Checked(alike, findings, at_best)
            if len(self._checked) > KEPT:
                self._checked.popitem(last=False)
        return known


def _now_s() -> float:
    return asyncio.get_running_loop().time()


def _unseen(vehicle_id: str) -> Candidate:
    return Candidate(vehicle_id=vehicle_id, refusals=why_unseen())
