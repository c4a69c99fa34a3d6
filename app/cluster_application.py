"""The composition root of a cluster's parts. `waydrop serve` needs nothing of this file and what it imports."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from functools import partial
from typing import Final

import structlog

from app import __version__
from app.api import ApiServices
from app.application import (
    access_to,
    audit_of,
    key_file,
    retention_of,
    running,
    serve,
    served,
    webhooks_of,
)
from app.cluster import BusSettings, open_bus, unusable_files
from app.config import PREFIX, Settings, SettingsError, require_access_control, require_part_of_cluster
from app.data_folder import claim_data_folder, folder_address
from app.domain.cluster.errors import GatewayUnreachableError
from app.domain.cluster.lease import Leaseholder, LeaseState
from app.domain.cluster.ports import ALL_STATES, LEFT_RUNS, Bus, GatewaySite, ProjectionWriter, calls_of
from app.domain.errors import StorageError
from app.file_limit import require_files
from app.services.attachments import Attachments
from app.services.background import background
from app.services.clock import Clock, SystemClock
from app.services.delivery_reports import Comparisons, DeliveryReports
from app.services.handover import LeftRunCalls, SiteHandover
from app.services.loop_watch import LoopWatch
from app.services.plan_work import PlanWork, plan_work
from app.services.plans import KnownPlans, Plans
from app.services.projection import Projection
from app.services.relay import Relay
from app.services.remote.calls import Caller, CallFunctions, CallServer
from app.services.remote.fleet import CallableFleet, Gateways, Reporter
from app.services.remote.gateway import GatewayCalls
from app.services.remote.gateway_services import GatewayServices
from app.services.remote.jobs import SHARED_JOBS, RemoteJobs
from app.services.remote.journal import ClusterJournal
from app.services.remote.runs import RemoteRuns
from app.services.remote.shared_jobs import SharedJobs, shared_job_calls
from app.services.remote.simulation import RemoteSimulation
from app.services.remote.targets import TARGETS_SUBJECT, SharedReports, SharedTargets
from app.services.remote.webhooks import LEADER, LEADER_CALLS, RemoteWebhooks, webhook_calls
from app.services.site_lease import SiteLease
from app.storage import Storage
from app.storage.postgres import ClusterStorage, open_cluster_storage

log = structlog.get_logger(__name__)

LOOK_S: Final = 5.0
"""How often an API node counts the open runs, for /metrics."""


async def serve_gateway(settings: Settings) -> None:
    """Run a gateway: the whole service, joined to a cluster. Raises as serve."""
    require_part_of_cluster(settings, "site", "cluster_key")
    _require_files(settings)
    await serve(settings, start=partial(running, join=joined))


async def serve_api(settings: Settings) -> None:
    """Run an API node. Raises as serve."""
    require_part_of_cluster(settings, "postgres_url", "cluster_key")
    _require_files(settings)
    await serve(settings, start=api_node)


@asynccontextmanager
async def joined(settings: Settings, storage: Storage, gateway: GatewayServices) -> AsyncIterator[SiteLease]:
    """The gateway's relay, its reports, and its answers to calls; yields the lease of its site.

    While another gateway has the site, nothing is reported, so that API nodes show and call the other one.
    """
    clock, site = SystemClock(), settings.site or ""
    part = GatewaySite(gateway=storage.gateway_id, site=site, address=folder_address(settings.data_dir))
    async with AsyncExitStack() as stack:
        bus = await stack.enter_async_context(open_bus(_bus(settings, f"gateway {site}")))
        caller = Caller(bus, _key(settings), _reached_here, clock)
        handover = SiteHandover(part, settings.system_id, gateway.fleet, gateway.runs, gateway.plans, caller)
        me = Leaseholder(
            gateway=part.gateway, address=part.address, system_id=settings.system_id, has_standby=settings.standby
        )
        lease = SiteLease(site, me, gateway.journal, bus, clock, handover)
        await stack.enter_async_context(lease.kept())
        gateway.fleet.gate_new_work(lease.why_no_new_work)
        gateway.fleet.gate_commands(lease.may_command)
        gateway.fleet.gate_runs(lease.is_left)
        calls, seq = GatewayCalls(gateway, part.gateway).functions(), lambda: gateway.journal.last_seq
        server = CallServer(part, calls, _key(settings), seq, clock, lambda: lease.why_no_new_work() is None)
        relay = Relay(site, storage.gateway_id, storage.relay_log, gateway.journal, bus)
        relaying = lease.while_allowed(lambda claim: claim.may_relay(part.gateway), relay.running)
        await stack.enter_async_context(background(relaying, "relay"))
        retention = retention_of(settings, storage.retention, gateway.journal, gateway.plans, relay.stored)
        await stack.enter_async_context(retention)
        reporter = Reporter(part, settings.gateway_url, gateway.fleet, gateway.journal, bus)
        reporting = lease.while_allowed(
            lambda claim: claim.state is not LeaseState.TAKEN,
            lambda: background(reporter.run(settings.telemetry_period_s), "reports"),
        )
        await stack.enter_async_context(background(reporting, "reporting"))
        reports = SharedReports(gateway.targets.report, clock)
        await stack.enter_async_context(bus.hearing(TARGETS_SUBJECT, reports.hear))
        await stack.enter_async_context(bus.answering(calls_of(site), server.answer))
        yield lease


@asynccontextmanager
async def api_node(settings: Settings) -> AsyncIterator[str]:
    """An API node, from its store to its port; yields its URL."""
    require_files(settings.max_connections)
    async with AsyncExitStack() as stack:
        claim_data_folder(settings.data_dir)
        storage = await stack.enter_async_context(_cluster_storage(settings))
        clock = SystemClock()
        require_access_control(settings, has_tokens=await access_to(storage.tokens, settings).has_tokens())
        journal = ClusterJournal(storage.events, clock)
        stack.push_async_callback(journal.close)
        await journal.start()
        bus = await stack.enter_async_context(open_bus(_bus(settings, "api")))
        node = _Node(settings, storage, journal, bus, clock, await stack.enter_async_context(plan_work()))
        targets = SharedTargets(clock, bus)
        await stack.enter_async_context(bus.hearing(TARGETS_SUBJECT, SharedReports(targets.report, clock).hear))
        projection = Projection(storage.projection, bus, clock, node.leading)
        stack.push_async_callback(projection.close)
        projection.start()
        services = await node.services(stack, targets, projection)
        yield await stack.enter_async_context(served(services, settings, storage.gateway_id))


class _Node:
    """What an API node is made of."""

    def __init__(
        self,
        settings: Settings,
        storage: ClusterStorage,
        journal: ClusterJournal,
        bus: Bus,
        clock: Clock,
        work: PlanWork,
    ) -> None:
        self._settings = settings
        self._storage = storage
        self._journal = journal
        self._bus = bus
        self._clock = clock
        self._caller = Caller(bus, _key(settings), journal.reached, clock)
        self._gateways = Gateways(self._caller)
        self._fleet = CallableFleet(clock, self._gateways)
        self._known = KnownPlans(storage.plans)
        self._plans = Plans(self._known, journal, clock, work)

    async def services(self, stack: AsyncExitStack, targets: SharedTargets, projection: Projection) -> ApiServices:
        """The services; what they run ends with the stack."""
        storage, journal, clock = self._storage, self._journal, self._clock
        gateways, fleet, known = self._gateways, self._fleet, self._known

        def receive(message: bytes) -> None:
            if (report := fleet.receive(message)) is not None:
                projection.hear(report)

        await stack.enter_async_context(self._bus.hearing(ALL_STATES, receive))
        runs = RemoteRuns(storage.runs, known, fleet, gateways)
        await stack.enter_async_context(background(_refresh(runs), "open runs"))
        return ApiServices(
            journal=journal,
            plans=self._plans,
            comparisons=Comparisons(runs, journal),
            attachments=Attachments(runs, storage.attachments, journal, clock),
            delivery_reports=DeliveryReports(
                runs, storage.plans, storage.attachments, journal, clock, storage.gateway_id
            ),
            access=access_to(storage.tokens, self._settings),
            fleet=fleet,
            runs=runs,
            rerouting=runs,
            jobs=RemoteJobs(storage.jobs, storage.shared_jobs, known, fleet, gateways, self._caller, clock),
            targets=targets,
            commands=fleet,
            links=fleet,
            offboard=None,
            tasks=None,
            simulation=RemoteSimulation(fleet),
            webhooks=RemoteWebhooks(self._caller),
            answers=storage.answers,
            claims=storage.claims,
            audit=await stack.enter_async_context(audit_of(storage, journal, clock)),
            loop_watch=LoopWatch(journal),
            clock=clock,
            gateways=fleet,
            readiness={"projection": projection.why_not_ready},
        )

    @asynccontextmanager
    async def leading(self, writer: ProjectionWriter) -> AsyncIterator[None]:
        """What one node does for all: it delivers webhooks, gives jobs to gateways, and deletes old data."""
        storage, journal, clock = self._storage, self._journal, self._clock
        jobs = SharedJobs(storage.shared_jobs, self._plans, journal, clock, self._fleet, self._gateways)
        left = LeftRunCalls(storage.runs, storage.plans, storage.events).functions()
        async with (
            webhooks_of(storage, journal, clock, self._settings) as webhooks,
            self._answering(writer, LEADER_CALLS, LEADER, webhook_calls(webhooks)),
            self._answering(writer, LEFT_RUNS, LEFT_RUNS, left),
            self._answering(writer, SHARED_JOBS, SHARED_JOBS, shared_job_calls(jobs)),
            background(jobs.run(), "shared jobs"),
            retention_of(self._settings, storage.retention, journal, self._plans),
        ):
            yield

    def _answering(
        self, writer: ProjectionWriter, subject: str, site: str, calls: CallFunctions
    ) -> AbstractAsyncContextManager[None]:
        async def require_right() -> None:
            try:
                await writer.check()
            except StorageError as error:
                raise GatewayUnreachableError(
                    "the node that answers cannot write to PostgreSQL any more: nothing was done", hint="try again"
                ) from error

        # what the calls record was fanned out on this node, and so is stored, before they return
        part = GatewaySite(gateway=self._storage.gateway_id, site=site)
        server = CallServer(part, calls, _key(self._settings), lambda: 0, self._clock, require_right=require_right)
        # a node that lost the right to write finds out a moment later, and meanwhile two nodes answer
        return self._bus.answering(subject, server.answer, in_queue_group=True)


@asynccontextmanager
async def _cluster_storage(settings: Settings) -> AsyncIterator[ClusterStorage]:
    url = "" if settings.postgres_url is None else settings.postgres_url.get_secret_value()
    async with open_cluster_storage(
        url, key_file=key_file(settings), attachments_max_bytes=settings.attachments_max_bytes
    ) as storage:
        yield storage


async def _reached_here(gateway: str, seq: int) -> None:
    """A gateway reads no events of others."""


async def _refresh(runs: RemoteRuns) -> None:
    while True:
        with suppress(StorageError):
            await runs.refresh()
        await asyncio.sleep(LOOK_S)


def _require_files(settings: Settings) -> None:
    """Raises SettingsError."""
    variables = {settings.nats_credentials: "NATS_CREDENTIALS", settings.nats_ca: "NATS_CA"}
    wrong = [
        f"{PREFIX}{variables[path]}: {path} cannot be used: {reason}"
        for path, reason in unusable_files(_bus(settings, "")).items()
    ]
    if wrong:
        raise SettingsError(
            "\n".join(wrong), hint="specify files that the user that runs Waydrop can read; see docs/how-to/cluster.md"
        )


def _bus(settings: Settings, name: str) -> BusSettings:
    return BusSettings(
        servers=settings.nats_servers,
        name=f"waydrop {__version__} {name}",
        credentials=settings.nats_credentials,
        ca=settings.nats_ca,
    )


def _key(settings: Settings) -> bytes:
    return b"" if settings.cluster_key is None else settings.cluster_key.get_secret_value().encode()
