"""Which vehicles are available for which job, looked up in slices so that the event loop keeps turning."""

from __future__ import annotations

import asyncio
import math
import time
from collections import OrderedDict
from collections.abc import Mapping, Sequence
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
    why_unfit,
)
from app.domain.jobs.job import MOST_REFUSALS, Candidate, Refusal, VehicleRefusal, VehicleSelector
from app.domain.offboard.state import OffboardState
from app.domain.plan import Plan, plan_hash
from app.domain.plan.walk import reference_home
from app.domain.ports.stores import RunFilter
from app.domain.prediction import CALM, Wind
from app.domain.rules import Finding, Severity, check_plan
from app.domain.run.run import Run
from app.domain.vehicle.clock import is_too_fast
from app.domain.vehicle.state import VehicleProfile
from app.services.fleet import Fleet, FleetVehicle
from app.services.jobs.repository import JobRepository
from app.services.runs import Runs

# Lets the loop turn within work that is long by its count: links, runs and sockets must not wait for the queue.


SLICE_S: Final = 0.001
"""Of the 5 ms that a slice may take: what is done between two breaths takes its time too."""


class TimeSlice:
    """One piece of work's own. Our time alone counts, so a fast clock of the vehicles changes nothing."""

    def __init__(self) -> None:
        self._since_s = time.monotonic()

    async def take(self) -> None:
        """Yield to the event loop if the time slice is used up."""
        if time.monotonic() - self._since_s >= SLICE_S:
            await self.give()

    async def give(self) -> None:
        """Yield to the event loop."""
        await asyncio.sleep(0)
        self._since_s = time.monotonic()


# The availability of the fleet's vehicles for jobs: who uses or controls them, and whether their queues run.


class VehicleAvailability:
    """Looks; the only thing that it changes is the queue of a vehicle whose newest run ended badly."""

    def __init__(self, fleet: Fleet, runs: Runs, book: JobRepository) -> None:
        self._fleet = fleet
        self._runs = runs
        self._repository = book

    async def all(self) -> Sequence[VehicleReadiness]:
        """Every vehicle of the fleet, by id; the loop turns in between, so one may be out of date: see `one`."""
        breath, open_runs, found = TimeSlice(), self._open_runs(), list[VehicleReadiness]()
        for vehicle in tuple(self._fleet.each()):
            found.append(self._of(vehicle, open_runs, None))
            await breath.take()
        return found

    def one(self, vehicle_id: str, own_run_id: str | None = None) -> VehicleReadiness:
        """One vehicle; that `own_run_id` has it does not count. Raises NotFoundError."""
        return self._of(self._fleet.vehicle(vehicle_id), self._open_runs(), own_run_id)

    def has(self, vehicle_id: str, run_id: str) -> bool:
        """Whether the run is followed on its vehicle. Raises NotFoundError."""
        return self._fleet.vehicle(vehicle_id).run_id == run_id

    async def newest_run(self, vehicle_id: str) -> Run | None:
        """The newest run of the vehicle, from any source. Raises StorageError."""
        found = await self._runs.list_runs(1, RunFilter(vehicle_id=vehicle_id))
        return found[0] if found else None

    async def judge(self, vehicle_id: str, now: float) -> None:
        """Stop the queue of the vehicle if its newest run ended badly and no operator resumed it since. Raises
        StorageError.
        """
        newest = await self.newest_run(vehicle_id)
        await self._repository.change_vehicle(vehicle_id, lambda queue: queue.judged(newest, now=now), "stopped")

    def _open_runs(self) -> Mapping[str, Sequence[str]]:
        """By vehicle. A run that an earlier process left is not assigned to a vehicle object yet, but its vehicle is
        busy.
        """
        found: dict[str, list[str]] = {}
        for run in self._runs.open_runs():
            if not run.is_over:
                found.setdefault(run.vehicle_id, []).append(run.id)
        return found

    def _of(
        self, vehicle: FleetVehicle, open_runs: Mapping[str, Sequence[str]], own_run_id: str | None
    ) -> VehicleReadiness:
        queue = self._repository.vehicle(vehicle.id)
        return VehicleReadiness(
            vehicle_id=vehicle.id,
            state=vehicle.link.state(),
            quarantined=vehicle.quarantined,
            held_by=self._holder(vehicle, open_runs.get(vehicle.id, ()), own_run_id),
            lease_holder=_lease_holder(vehicle),
            stopped=queue.reason if queue.stopped else None,
            no_new_work=self._fleet.why_no_new_work(),
        )

    def _holder(self, vehicle: FleetVehicle, open_runs: Sequence[str], own_run_id: str | None) -> str | None:
        for run_id in (vehicle.run_id, *open_runs):
            if run_id is not None and run_id != own_run_id:
                return f"run {run_id}"
        job = self._repository.queue.holder_of(vehicle.id)
        return None if job is None or (own_run_id is not None and job.run_id == own_run_id) else f"job {job.id}"


def _lease_holder(vehicle: FleetVehicle) -> str | None:
    """The holder of offboard control. While leaving there may be no lease any more; it still counts."""
    view = vehicle.offboard()
    if view is None:
        return None
    if view.lease is not None:
        return view.lease.holder
    return None if view.state is OffboardState.IDLE else "a client whose offboard control is ending"


# Looks at vehicles for a plan: each with its own parameters and state, by the full rule set.


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

    def __init__(self, fleet: Fleet, facts_s: float) -> None:
        self._fleet = fleet
        self._facts_s = facts_s
        self._checked: OrderedDict[tuple[str, Wind, str], _Checked] = OrderedDict()
        self._asking: dict[str, asyncio.Task[VehicleProfile]] = {}

    async def close(self) -> None:
        """Ask no further. Idempotent."""
        asking = tuple(self._asking.values())
        for task in asking:
            task.cancel()
        await asyncio.gather(*asking, return_exceptions=True)

    async def candidates(
        self,
        plan: Plan,
        selector: VehicleSelector,
        vehicles: Sequence[VehicleReadiness],
        wind: Wind = CALM,
        facts_s: float | None = None,
    ) -> tuple[Candidate, ...]:
        """All vehicles of the fleet, and those that the selector names and that never connected; one may be chosen.

        The rules use the wind. `facts_s`: a shorter time limit for vehicles to report their facts.
        """
        key = (await asyncio.to_thread(plan_hash, plan), wind)
        seen = {vehicle.vehicle_id for vehicle in vehicles}
        asked = await self._ask(
            [
                vehicle.vehicle_id
                for vehicle in vehicles
                if selector.allows(vehicle.vehicle_id) and vehicle.state.connected
            ],
            self._facts_s if facts_s is None else facts_s,
        )
        breath, looked = TimeSlice(), []
        for vehicle in vehicles:
            looked.append(await self._candidate(key, plan, selector, vehicle, asked.get(vehicle.vehicle_id)))
            await breath.take()
        return choose([*looked, *(_unseen(name) for name in selector.named if name not in seen)])

    async def _candidate(
        self,
        key: tuple[str, Wind],
        plan: Plan,
        selector: VehicleSelector,
        vehicle: VehicleReadiness,
        asked: asyncio.Task[VehicleProfile] | None,
    ) -> Candidate:
        state = vehicle.state
        refusals = [*why_not_ready(vehicle), *why_not_selected(vehicle.vehicle_id, state.battery_percent, selector)]
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

    async def _ask(self, vehicle_ids: Sequence[str], within_s: float) -> Mapping[str, asyncio.Task[VehicleProfile]]:
        """Ask these for their facts, a few in each turn of the loop, and wait for all of them together.

        One that has not answered in time is asked on.
        """
        breath, asked = TimeSlice(), dict[str, asyncio.Task[VehicleProfile]]()
        for vehicle_id in vehicle_ids:
            if vehicle_id not in self._asking:
                ask = self._fleet.facts(vehicle_id)
                self._asking[vehicle_id] = asyncio.create_task(ask, name=f"facts {vehicle_id}")
            asked[vehicle_id] = self._asking[vehicle_id]
            if len(asked) % ASKED_AT_ONCE == 0:
                await breath.give()
        if asked:
            await asyncio.wait(asked.values(), timeout=within_s)
        for vehicle_id, task in asked.items():
            if task.done() and self._asking.get(vehicle_id) is task:
                del self._asking[vehicle_id]
        return asked

    async def _check(self, key: tuple[str, Wind], plan: Plan, vehicle_id: str, facts: VehicleProfile) -> _Checked:
        rate = facts.least_clock_rate  # measured anew each moment, and only this of it matters to the rules
        charge = facts.battery_percent  # in whole per cent, for the same reason
        facts = replace(facts, battery_percent=None if charge is None else math.floor(charge))
        alike = replace(facts, least_clock_rate=1.0 if rate is None or not is_too_fast(rate) else 1e3)
        known = self._checked.get((*key, vehicle_id))
        if known is None or known.facts != alike:
            findings, at_best = await asyncio.to_thread(_rules, plan, facts, key[1])
            known = self._checked[(*key, vehicle_id)] = _Checked(alike, findings, at_best)
            if len(self._checked) > KEPT:
                self._checked.popitem(last=False)
        return known


def _rules(plan: Plan, facts: VehicleProfile, wind: Wind) -> tuple[tuple[Finding, ...], frozenset[str]]:
    """What the rules find, and the codes of its errors that stay with a full battery at the plan's own home."""
    findings = check_plan(plan, facts, wind)
    if not (errors := _errors(findings)):
        return findings, errors
    home = None if plan.home is None else reference_home(plan, None)
    return findings, _errors(check_plan(plan, replace(facts, battery_percent=100.0, home=home), wind))


def _errors(findings: Sequence[Finding]) -> frozenset[str]:
    return frozenset(finding.code for finding in findings if finding.severity is Severity.ERROR)


def _unseen(vehicle_id: str) -> Candidate:
    message = "the vehicle has not connected since Waydrop started"
    refusal = Refusal(code=VehicleRefusal.UNKNOWN.value, message=message, hint="list the vehicles to see their IDs")
    return Candidate(vehicle_id=vehicle_id, refusals=(refusal,))
