"""The services of a gateway with scripted vehicles, one plan and a queue of jobs; they can be killed at any event."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from unittest import mock

from app.domain.errors import StorageError
from app.domain.jobs.job import Job
from app.domain.jobs.queue import VehicleQueue
from app.domain.plan import parse_plan
from app.domain.ports.stores import JobFilter
from app.domain.ports.vehicle_link import VehicleIdentity
from app.domain.vehicle.state import FirmwareVersion, FlightMode, GlobalPosition, LandedState, MissionState, VehicleType
from app.services.fleet import Fleet
from app.services.jobs import Jobs, JobSettings
from app.services.jobs.scheduler import JobScheduler
from app.services.jobs.views import JobRequest
from app.services.journal import Journal
from app.services.plans import KnownPlans, Plans
from app.services.runs import Runs, RunSettings
from tests.support.fakes import MemoryEventStore, MemoryFlightLog
from tests.support.job_plans import LAST_SEQ, ROUTE
from tests.support.known_links import KnownLinks
from tests.support.patience import Patience
from tests.support.run_service import MemoryPlans, MemoryRuns
from tests.support.scripted_link import FAST, ScriptedVehicle

PROMPT = JobSettings(poll_every_s=0.01, retry_after_s=0.02, facts_s=0.05, late_for_s=0.05)
WITHIN_S = 20.0
SOME_PASSES = 10
"""Of the scheduler: what must not happen has its chance to."""
HOME = GlobalPosition(47.397742, 8.545594, 488.0)


class ShiftedClock:
    """The machine's clocks; the time of day can be moved on."""

    def __init__(self) -> None:
        self.ahead_s = 0.0

    def now(self) -> float:
        """See Clock."""
        return time.time() + self.ahead_s

    def monotonic(self) -> float:
        """See Clock."""
        return time.monotonic()


class MemoryJobs:
    """JobStore over what the event store was given."""

    def __init__(self, events: MemoryEventStore) -> None:
        self._events = events

    async def get(self, job_id: str) -> Job | None:
        return self._events.jobs.get(job_id)

    async def list_jobs(self, wanted: JobFilter, *, limit: int) -> Sequence[Job]:
        jobs = [job for job in self._events.jobs.values() if not (wanted.open_only and job.is_over)]
        named = [job for job in jobs if wanted.vehicle_id in (None, job.vehicle_id or job.selector.vehicle)]
        return named[::-1][:limit]

    async def list_queues(self) -> Sequence[VehicleQueue]:
        return tuple(self._events.queues.values())


@dataclass
class JobService:
    """What outlives a service: vehicles, disk, clock; and the service that runs now."""

    vehicles: tuple[ScriptedVehicle, ...]
    site: str | None = None
    settings: RunSettings = FAST
    events: MemoryEventStore = field(default_factory=MemoryEventStore)
    clock: ShiftedClock = field(default_factory=ShiftedClock)
    passes: int = 0
    """Completed passes of the scheduler."""

    async def begin(self, *, hears_vehicles: bool = True) -> None:
        """Start a service."""
        plans = MemoryPlans()
        plans.add(parse_plan(ROUTE))
        self.journal = Journal(self.events, self.clock)
        await self.journal.start()
        self.links = KnownLinks(*(self.vehicles if hears_vehicles else ()))
        self.fleet = Fleet(self.links, self.journal, site=self.site)
        await self.fleet.start()
        self.plans = Plans(KnownPlans(plans), self.journal, self.clock)
        runs = MemoryRuns(self.events)
        self.runs = Runs(self.fleet, self.plans, runs, self.journal, self.clock, MemoryFlightLog(), self.settings)
        await self.runs.begin()
        store = MemoryJobs(self.events)
        self.jobs = Jobs(store, self.plans, self.runs, self.fleet, self.journal, self.clock, PROMPT)
        await self.jobs.begin()

    async def end(self) -> None:
        """It is gone without a goodbye: nothing is told to a vehicle."""
        for part in (self.jobs, self.runs, self.fleet, self.journal):
            await part.close()

    async def restart(self, *, hears_vehicles: bool = True) -> None:
        """Another process on the same disk. Unless it hears the vehicles, they are off until `switch_on`."""
        await self.end()
        await self.begin(hears_vehicles=hears_vehicles)

    def switch_on(self) -> None:
        """The vehicles send their first messages to this process."""
        self.links.find(*self.vehicles)

    def die_at(self, event: int) -> None:
        """From this event on nothing is stored any more, as after a kill."""
        dead = StorageError("killed")
        self.events.refuse = lambda _: dead if len(self.events.events) >= event else None

    def revive(self) -> None:
        """The disk takes events again."""
        self.events.refuse = lambda _: None

    async def order(self, **fields: object) -> Job:
        """A new job of the plan."""
        order = JobRequest.model_validate({"plan": "plan-1", "min_battery_percent": 0, **fields})
        return await self.jobs.create(order, "desk")

    def job(self, job: Job) -> Job:
        """The job as stored."""
        return self.events.jobs[job.id]

    def armed(self) -> int:
        """How often any vehicle was armed."""
        return sum(vehicle.sent.count("arm") for vehicle in self.vehicles)

    async def until(self, what: Callable[[], bool], promise: str) -> None:
        """Wait for a condition."""
        patience = Patience(WITHIN_S)
        while not what():
            assert not patience.is_over(), f"{promise}; jobs: {list(self.events.jobs.values())}"
            await asyncio.sleep(0.005)

    async def until_events(self, count: int) -> None:
        """Wait until so many events are stored."""
        await self.until(lambda: len(self.events.events) >= count, f"there must be {count} events")

    async def some_passes(self) -> None:
        """Wait until the scheduler has completed some more passes."""
        enough = self.passes + SOME_PASSES
        await self.until(lambda: self.passes >= enough, "the scheduler must go on")

    async def until_state(self, job: Job, *states: str) -> Job:
        await self.until(lambda: self.job(job).state.value in states, f"the job must become {states}")
        return self.job(job)

    async def fly(self, job: Job) -> Job:
        """Let the vehicle of a flying job do its mission, land and disarm; the job when it is over."""
        flying = self.job(job)
        vehicle = next(one for one in self.vehicles if f"v{one.identity.system_id}" == flying.vehicle_id)
        vehicle.put(landed=LandedState.IN_AIR, mission_seq=LAST_SEQ)
        run_id = flying.run_id or ""
        await self.until(lambda: self.events.runs[run_id].item_id == "home", "the way home must be seen")
        vehicle.touch_down(complete=True, last_seq=LAST_SEQ)
        vehicle.put(mode=FlightMode.HOLD, mission_state=MissionState.COMPLETE)
        return await self.until_state(job, "completed", "failed")


def a_vehicle(number: int) -> ScriptedVehicle:
    """A vehicle on the ground at home."""
    vehicle = ScriptedVehicle()
    firmware = FirmwareVersion(1, 18, 0)
    vehicle.identity = VehicleIdentity(number, "udpin://scripted", VehicleType.MULTICOPTER, firmware, f"uid-{number}")
    vehicle.put(home=HOME, battery_percent=80.0)
    return vehicle


@asynccontextmanager
async def job_service(
    count: int = 1, site: str | None = None, settings: RunSettings = FAST
) -> AsyncIterator[JobService]:
    """Running services, as a single Waydrop or as the gateway of a site."""
    service = JobService(tuple(a_vehicle(number) for number in range(1, count + 1)), site, settings)
    poll = JobScheduler.poll

    async def counted(scheduler: JobScheduler) -> None:
        await poll(scheduler)
        service.passes += 1

    with mock.patch.object(JobScheduler, "poll", counted):
        await service.begin()
        try:
            yield service
        finally:
            await service.end()
