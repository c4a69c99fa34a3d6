"""Two sites in memory, and the node that gives them the jobs that both may fly. What travels between may be lost."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from functools import partial

from app.domain.cluster.errors import NoReplyError
from app.domain.cluster.ports import GatewaySite, calls_of
from app.domain.errors import ConflictError
from app.domain.events import Event, NewEvent
from app.domain.jobs.job import Job, JobState
from app.domain.jobs.queue import VehicleQueue
from app.domain.plan import parse_plan
from app.domain.ports.stores import JobFilter, JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run
from app.services.jobs.views import JobRequest, JobSettings
from app.services.journal import Journal
from app.services.plans import KnownPlans, Plans
from app.services.remote.calls import Caller, CallFunctions, CallServer
from app.services.remote.fleet import CallableFleet, Gateways, SiteReport
from app.services.remote.gateway import GatewayCalls
from app.services.remote.gateway_services import GatewayServices
from app.services.remote.shared_jobs import SharedJobs
from app.services.runs.rerouting import Rerouting
from app.services.targets import Targets
from app.services.vehicle_commands import VehicleCommands
from app.services.vehicle_links import VehicleLinks
from tests.support.fakes import MemoryEventStore
from tests.support.job_plans import ROUTE
from tests.support.job_service import JobService, ShiftedClock, job_service
from tests.support.known_guards import KnownGuards
from tests.support.memory_cluster import MemoryBus
from tests.support.run_service import MemoryPlans

KEY = b"k" * 32
SITES = ("north", "south")
PROMPT = JobSettings(poll_every_s=0.01, retry_after_s=0.03, late_for_s=0.05)


def calls_into(service: JobService, gateway: str) -> CallFunctions:
    """What API nodes may ask of the service's gateway."""
    services = GatewayServices(
        fleet=service.fleet,
        commands=VehicleCommands(service.fleet, service.journal),
        links=VehicleLinks(KnownGuards(), service.fleet, service.journal),
        plans=service.plans,
        runs=service.runs,
        rerouting=Rerouting(service.runs, service.plans),
        jobs=service.jobs,
        targets=Targets(service.clock),
        journal=service.journal,
    )
    return GatewayCalls(services, gateway).functions()


class LossyBus(MemoryBus):
    """`loses_request` and `loses_answer` choose by subject; a lost request may be delivered later: `late`."""

    def __init__(self) -> None:
        super().__init__()
        self.loses_request: Callable[[str], bool] = lambda subject: False
        self.loses_answer: Callable[[str], bool] = lambda subject: False
        self.late: list[tuple[str, bytes]] = []

    async def request(self, subject: str, message: bytes, *, timeout_s: float) -> bytes:
        """See Bus."""
        if self.loses_request(subject):
            self.late.append((subject, message))
            raise NoReplyError("lost on its way there")
        answer = await super().request(subject, message, timeout_s=timeout_s)
        if self.loses_answer(subject):
            raise NoReplyError("lost on its way back")
        return answer

    async def deliver_late(self) -> None:
        """What was lost on its way there arrives, and nobody hears the answers."""
        late, self.late = self.late, []
        for subject, message in late:
            await super().request(subject, message, timeout_s=1.0)


CHANGED_HERE = (JobState.QUEUED, JobState.PREPARING, JobState.PREPARED, JobState.RETURNED)


class OwnEvents(MemoryEventStore):
    """The cluster's own chain. As PostgreSQL does, it refuses a job whose fencing number is not higher, or which was
    started or ended.
    """

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """See EventStore."""
        for job in jobs:
            known = self.jobs.get(job.id) if isinstance(job, Job) else None
            if known is not None and (job.fence <= known.fence or known.state not in CHANGED_HERE):
                raise ConflictError(f"job {job.id} was changed by another node meanwhile")
        return await super().append(events, runs, plans, jobs, answers)


class MemorySharedJobs:
    """SharedJobStore over the cluster's own records, and those of the gateways whose relay arrives."""

    def __init__(self, own: MemoryEventStore, services: dict[str, JobService]) -> None:
        self._own = own
        self._services = services
        self.cut_off: set[str] = set()
        self.is_restored = False

    def jobs(self) -> dict[str, Job]:
        """As PostgreSQL would have them."""
        for site, service in self._services.items():
            for job in () if site in self.cut_off else service.events.jobs.values():
                if job.fence > 0 and job.supersedes(self._own.jobs[job.id]):
                    self._own.jobs[job.id] = job
        return self._own.jobs

    async def get(self, job_id: str) -> Job | None:
        return self.jobs().get(job_id)

    async def list_jobs(self, wanted: JobFilter, *, limit: int) -> Sequence[Job]:
        taken = {job.id for job in self.jobs().values() if job.claim is not None and job.claim.taken}
        found = [job for job in self.jobs().values() if job.id not in taken]
        return [job for job in found if not (wanted.open_only and job.is_over)][:limit]

    async def list_queues(self) -> Sequence[VehicleQueue]:
        return ()

    async def returned(self) -> Sequence[Job]:
        found = [job for job in self.jobs().values() if job.state is JobState.RETURNED]
        return [] if self.is_restored else found


@dataclass
class Sites:
    """Two sites with a vehicle each, and the node."""

    services: dict[str, JobService]
    bus: LossyBus
    store: MemorySharedJobs
    fleet: CallableFleet
    own: MemoryEventStore
    clock: ShiftedClock = field(default_factory=ShiftedClock)
    servers: dict[str, CallServer] = field(default_factory=dict)
    node: SharedJobs | None = None

    def serve(self, site: str) -> None:
        """The gateway of the site answers from now on with what runs there now."""
        service, part = self.services[site], part_of(site)
        self.servers[site] = CallServer(part, calls_into(service, part.gateway), KEY, lambda: 0, service.clock)

    async def restart(self, site: str) -> None:
        """The gateway is killed and starts again."""
        await self.services[site].restart()
        self.serve(site)

    async def lead(self) -> SharedJobs:
        """A node begins to give jobs to gateways; it knows nothing of the one before."""
        clock = self.clock
        journal, plans = Journal(self.own, clock), MemoryPlans()
        await journal.start()
        plans.add(parse_plan(ROUTE))
        gateways = Gateways(Caller(self.bus, KEY, _reached, clock))
        known = Plans(KnownPlans(plans), journal, clock)
        self.node = SharedJobs(self.store, known, journal, clock, self.fleet, gateways, PROMPT)
        return self.node

    def pass_time(self, time_s: float) -> None:
        """It is later, everywhere."""
        for clock in (self.clock, *(service.clock for service in self.services.values())):
            clock.ahead_s += time_s

    async def order(self, **fields: object) -> Job:
        """A job that any vehicle may fly."""
        assert self.node is not None
        order = JobRequest.model_validate({"plan": "plan-1", "min_battery_percent": 0, "auto_start": True, **fields})
        return await self.node.create(order, "desk")

    def job(self, job: Job) -> Job:
        """As the cluster has it."""
        return self.store.jobs()[job.id]

    def armed(self) -> dict[str, int]:
        """How often vehicles were armed, by site."""
        return {site: service.armed() for site, service in self.services.items()}

    async def until(self, what: Callable[[], bool], promise: str) -> None:
        """Let the node look again and again until it holds."""
        assert self.node is not None

        async def looked() -> None:
            while not what():
                await self.node.poll()  # type: ignore[union-attr]
                await asyncio.sleep(0.005)

        try:
            async with asyncio.timeout(20.0):
                await looked()
        except TimeoutError:
            raise AssertionError(f"{promise}; jobs: {list(self.store.jobs().values())}") from None


def part_of(site: str) -> GatewaySite:
    """The gateway of a site."""
    return GatewaySite(gateway=f"gw-{site}", site=site)


async def _answer(sites: Sites, site: str, message: bytes) -> bytes:
    return await sites.servers[site].answer(message)


async def _report(sites: Sites, site: str) -> None:
    while True:
        service, part = sites.services[site], part_of(site)
        vehicles = tuple(service.fleet.vehicles())
        report = SiteReport(gateway=part.gateway, site=site, url="", vehicles=vehicles)
        sites.fleet.receive(report.model_dump_json().encode())
        await asyncio.sleep(0.01)


async def _reached(gateway: str, seq: int) -> None:
    """What a gateway has stored is there when it is read."""


@asynccontextmanager
async def two_sites() -> AsyncIterator[Sites]:
    """Both report; a node leads."""
    async with AsyncExitStack() as stack:
        bus, clock, own = LossyBus(), ShiftedClock(), OwnEvents()
        fleet = CallableFleet(clock, Gateways(Caller(bus, KEY, _reached, clock)))
        services = {site: await stack.enter_async_context(job_service(site=site)) for site in SITES}
        sites = Sites(services, bus, MemorySharedJobs(own, services), fleet, own)
        for site in services:
            sites.serve(site)
            await stack.enter_async_context(bus.answering(calls_of(site), partial(_answer, sites, site)))
            task = asyncio.create_task(_report(sites, site), name=f"reports of {site}")
            stack.push_async_callback(asyncio.gather, task, return_exceptions=True)
            stack.callback(task.cancel)
        await sites.lead()
        await sites.until(lambda: len(fleet.vehicles()) == len(SITES), "both sites must report")
        yield sites
