"""A running service around one scripted vehicle and one plan, which can be restarted."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections import Counter
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass, field

from app.domain.drop.record import DropRecord
from app.domain.flight.recording import from_text, replay
from app.domain.mission import Mission
from app.domain.plan import Plan, parse_plan, plan_hash
from app.domain.plan.compiler import compile_plan
from app.domain.ports.stores import RunFilter, StoredPlan
from app.domain.run.run import Run, RunState
from app.domain.vehicle.performance import Performance
from app.services.clock import Clock, SystemClock
from app.services.fleet import Fleet
from app.services.flight_threads import FlightThreads
from app.services.journal import Journal
from app.services.plan_work import PlanWork
from app.services.plans import KnownPlans, Plans
from app.services.runs import Runs, RunSettings
from app.services.runs.flight import RunFlight
from app.services.targets import Targets
from tests.support.fakes import MemoryEventStore, MemoryFlightLog
from tests.support.known_links import KnownLinks
from tests.support.paths import PLANS
from tests.support.scripted_link import FAST, ScriptedVehicle

WITHIN_S = 30.0
SOME_LOOKS = 10


@dataclass
class MemoryPlans:
    """PlanStore in a dict."""

    plans: dict[str, StoredPlan] = field(default_factory=dict)

    def add(self, plan: Plan, plan_id: str = "plan-1") -> None:
        """Store a plan."""
        document = plan.model_dump(mode="json")
        self.plans[plan_id] = StoredPlan(plan_id, plan_hash(plan), plan.name, plan.vehicle_type, 0.0, "test", document)

    async def get(self, plan_id: str) -> StoredPlan | None:
        return self.plans.get(plan_id)

    async def list_plans(self, *, limit: int, older_than: str | None = None) -> Sequence[StoredPlan]:
        return list(self.plans.values())[:limit]


class MemoryRuns:
    """RunStore over what the event store was given."""

    def __init__(self, events: MemoryEventStore) -> None:
        self._events = events

    async def get(self, run_id: str) -> Run | None:
        return self._events.runs.get(run_id)

    async def list_runs(self, wanted: RunFilter, *, limit: int) -> Sequence[Run]:
        newest_first = [*reversed(self._events.runs.values())]
        if wanted.older_than is not None:
            newest_first = newest_first[[run.id for run in newest_first].index(wanted.older_than) + 1 :]
        found = [run for run in newest_first if wanted.vehicle_id in (None, run.vehicle_id)]
        return [run for run in found if not (wanted.open_only and run.is_over)][:limit]

    async def open_states(self) -> Mapping[RunState, int]:
        return Counter(run.state for run in self._events.runs.values() if not run.is_over)


@dataclass
class RunService:
    """A service with one vehicle and one plan."""

    vehicle: ScriptedVehicle
    events: MemoryEventStore
    journal: Journal
    fleet: Fleet
    runs: Runs
    plans: MemoryPlans
    plan: Plan
    mission: Mission
    flight_log: MemoryFlightLog
    targets: Targets
    run_id: str = ""

    async def create(self, *, start: bool = True) -> Run:
        run = await self.runs.create("plan-1", "v1", start=start, actor="test")
        self.run_id = run.id
        return run

    @property
    def run(self) -> Run:
        """The run as stored."""
        return self.events.runs[self.run_id]

    @property
    def flight(self) -> RunFlight:
        """The flight that is followed now."""
        flight = self.runs.flight(self.run_id)
        assert flight is not None
        return flight

    @property
    def newest(self) -> Run:
        """The run as it is now, perhaps not stored yet."""
        return self.flight.flight.run

    @property
    def drop(self) -> DropRecord:
        """The first drop's record."""
        return self.run.drops[0]

    async def until(self, what: Callable[[], bool], promise: str) -> None:
        """Wait for a condition."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(WITHIN_S):
                while not what():
                    await asyncio.sleep(0.005)
        assert what(), f"{promise}; the run is {self.run.state.value} ({self.run.reason}), drops {self.run.drops}"

    async def some_looks(self) -> None:
        """Wait until the vehicle was looked at some more times: what must not happen has its chance to."""
        enough = self.vehicle.looks + SOME_LOOKS
        await self.until(lambda: self.vehicle.looks >= enough, "the vehicle must be looked at")

    async def until_state(self, *states: RunState) -> None:
        await self.until(lambda: self.run.state in states, f"the run must become {[s.value for s in states]}")

    async def fly_to_drop(self) -> None:
        """Start, and stop in the hold of the first drop."""
        await self.until_state(RunState.FLYING)
        drop = self.mission.drops[0]
        await self.vehicle.fly_to_hold(drop.latitude_deg, drop.longitude_deg, drop.hold_seqs[0])

    def kinds(self) -> list[str]:
        """The kinds of this run's events, in order."""
        return [event.kind.value for event in self.events.events if event.run_id == self.run_id]


@contextlib.asynccontextmanager
async def run_service(
    plan_file: str = "clinic-run.json",
    *,
    changes: Callable[[dict[str, object]], None] | None = None,
    performance: Performance | None = None,
    settings: RunSettings = FAST,
    target_clock: Clock | None = None,
) -> AsyncIterator[RunService]:
    """A running service around one scripted vehicle."""
    document = json.loads((PLANS / plan_file).read_text())
    if changes is not None:
        changes(document)
    plan = parse_plan(document)
    vehicle, events, clock = ScriptedVehicle(plan.vehicle_type), MemoryEventStore(), SystemClock()
    plans = MemoryPlans()
    plans.add(plan)
    journal = Journal(events, clock)
    await journal.start()
    fleet = Fleet(KnownLinks(vehicle), journal, None if performance is None else {"v1": performance})
    await fleet.start()
    flight_log = MemoryFlightLog()
    threads = FlightThreads()
    known = Plans(KnownPlans(plans, threads.run), journal, clock, PlanWork(of_flights=threads.run))
    targets = Targets(clock if target_clock is None else target_clock)
    runs = Runs(fleet, known, MemoryRuns(events), journal, clock, flight_log, settings, targets)
    mission = compile_plan(plan, vehicle.facts)
    try:
        service = RunService(vehicle, events, journal, fleet, runs, plans, plan, mission, flight_log, targets)
        yield service
    finally:
        events.open.set()  # a test that fails while nothing is stored must not hang
        await runs.close()
        await fleet.close()
        await journal.close()
        threads.close()
    await service.runs.close()
    for run_id, text in flight_log.texts.items():
        assert replay(from_text(text)).differences == (), f"run {run_id} must be decided again as it was"


async def restarted(
    before: RunService, *, meanwhile: Callable[[], None] = lambda: None, settings: RunSettings = FAST
) -> tuple[Runs, Fleet, Journal]:
    """The same vehicle, plans and disk under a new process of the service; the old one is gone without a goodbye."""
    await before.runs.close()
    await before.fleet.close()
    await before.journal.close()
    meanwhile()
    clock = SystemClock()
    journal = Journal(before.events, clock)
    await journal.start()
    fleet = Fleet(KnownLinks(before.vehicle), journal)
    await fleet.start()
    plans = Plans(KnownPlans(before.plans), journal, clock)
    runs = Runs(fleet, plans, MemoryRuns(before.events), journal, clock, before.flight_log, settings)
    await runs.begin()
    before.runs, before.fleet, before.journal = runs, fleet, journal
    return runs, fleet, journal
