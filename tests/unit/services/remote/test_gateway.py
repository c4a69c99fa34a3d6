"""What is asked of an API node is done by the gateway that has the vehicle, in the name of who asked."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest

from app.domain.cluster.ports import ALL_STATES, GatewaySite, calls_of
from app.domain.errors import NotFoundError, VehicleQuarantinedError
from app.domain.events import EventKind
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.facts import DuplicateSystem
from app.services.clock import SystemClock
from app.services.jobs.views import JobUpdate
from app.services.plans import KnownPlans
from app.services.remote.calls import Caller, CallServer
from app.services.remote.fleet import CallableFleet, Gateways, Reporter
from app.services.remote.jobs import RemoteJobs
from app.services.remote.journal import ClusterJournal
from tests.support.events import data_of
from tests.support.fakes import MemoryEventStore
from tests.support.job_service import JobService, MemoryJobs, job_service
from tests.support.memory_cluster import MemoryBus, MemoryClusterEvents
from tests.support.run_service import MemoryPlans
from tests.support.scheduled_jobs import IN_YEARS
from tests.support.shared_jobs import MemorySharedJobs, calls_into

SITE, VEHICLE = "north", "north-v1"
KEY = b"k" * 32
PART = GatewaySite(gateway="gw-1", site=SITE)


class SitedMemoryJobs(MemoryJobs):
    """SitedJobs of one site."""

    async def site_of(self, job_id: str) -> str | None:
        """See SitedJobs."""
        return None if await self.get(job_id) is None else SITE


@dataclass(frozen=True)
class Node:
    """An API node, and the services of the only site."""

    fleet: CallableFleet
    jobs: RemoteJobs
    service: JobService


@asynccontextmanager
async def a_node() -> AsyncIterator[Node]:
    """A node that has heard of the site's vehicle."""
    bus = MemoryBus()
    async with job_service(site=SITE) as service:
        server = CallServer(PART, calls_into(service, PART.gateway), KEY, lambda: 0, service.clock)
        caller = Caller(bus, KEY, ClusterJournal(MemoryClusterEvents(), service.clock).reached, service.clock)
        gateways = Gateways(caller)
        fleet = CallableFleet(service.clock, gateways)
        shared = MemorySharedJobs(MemoryEventStore(), {})
        jobs = RemoteJobs(
            SitedMemoryJobs(service.events), shared, KnownPlans(MemoryPlans()), fleet, gateways, caller, SystemClock()
        )
        async with bus.answering(calls_of(SITE), server.answer), bus.hearing(ALL_STATES, fleet.receive):
            reports = asyncio.create_task(Reporter(PART, "", service.fleet, service.journal, bus).run(0.01))
            try:
                await service.until(lambda: bool(fleet.vehicles()), "the site must report")
                yield Node(fleet, jobs, service)
            finally:
                reports.cancel()
                await asyncio.gather(reports, return_exceptions=True)


async def test_a_quarantine_is_ended_through_a_node() -> None:
    async with a_node() as node:
        node.service.vehicles[0].put(DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS)))
        await node.service.until(lambda: node.fleet.view(VEHICLE).quarantined is not None, "the node must hear of it")
        with pytest.raises(VehicleQuarantinedError):
            node.fleet.require_usable(VEHICLE)
        assert (await node.fleet.end_quarantine(VEHICLE, "anna")).quarantined is None
        await node.service.until(lambda: node.fleet.view(VEHICLE).quarantined is None, "the node must hear of its end")
        node.fleet.require_usable(VEHICLE)
        events = node.service.events.events
        ends = [data_of(event) for event in events if event.kind is EventKind.VEHICLE_QUARANTINE_ENDED]
        assert ends == [{"actor": "anna"}]
        with pytest.raises(NotFoundError, match="north-v7"):
            await node.fleet.end_quarantine("north-v7", "anna")


async def test_a_waiting_job_is_moved_before_another_through_a_node() -> None:
    async with a_node() as node:
        first, second = [await node.service.order(not_before=IN_YEARS, priority=one) for one in (5, 0)]
        moved = await node.jobs.move(second.id, JobUpdate(before=first.id), "anna")
        assert (moved.id, moved.priority) == (second.id, 5)
        assert [job.id for job in (await node.jobs.queues()).waiting] == [second.id, first.id]
        with pytest.raises(NotFoundError, match="job-x"):
            await node.jobs.move(second.id, JobUpdate(before="job-x"), "anna")
