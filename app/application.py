"""The composition root: the one file that sees every part and puts them together."""

from __future__ import annotations

import asyncio
import gc
import signal
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import structlog

from app import __version__
from app.api import ApiServices, ApiSettings, MapSettings, build_app
from app.api.application import ROUTES
from app.api.connections import ConnectionLimits
from app.api.openapi import openapi_document as describe
from app.api.server import serving
from app.api.tls import TlsFiles
from app.config import Settings, misspelt_settings, require_access_control
from app.data_folder import claim_data_folder
from app.domain.cluster.lease import SiteClaim
from app.domain.errors import NotFoundError, StorageError
from app.domain.events.event import JournalHead
from app.domain.events.service import ServiceStarted, ServiceStopped
from app.domain.flight.recording import Replay, from_text, replay
from app.domain.ports.journal import AuditedJournal, EventJournal
from app.domain.ports.link_keys import LinkKeys
from app.domain.ports.stores import RetentionStore, TokenStore
from app.domain.ports.threads import InThread
from app.file_limit import require_files
from app.services.access import Access
from app.services.attachments import Attachments
from app.services.audit import Audit
from app.services.clock import Clock, SystemClock
from app.services.delivery_reports import Comparisons, DeliveryReports
from app.services.fleet import Fleet
from app.services.flight_threads import flight_threads
from app.services.hang_watch import hang_watch
from app.services.jobs import Jobs
from app.services.journal import Journal
from app.services.loop_watch import LoopWatch
from app.services.offboard import Offboard, OffboardSettings
from app.services.offboard.offboard import recover_interrupted
from app.services.plan_work import plan_work
from app.services.plans import KnownPlans, Plans
from app.services.remote.gateway_services import GatewayServices
from app.services.retention import Retention, RetentionPeriods
from app.services.runs import Runs
from app.services.runs.rerouting import Rerouting
from app.services.simulation import Simulation
from app.services.site_lease import SiteLease
from app.services.targets import Targets
from app.services.tasks import Tasks
from app.services.vehicle_commands import VehicleCommands
from app.services.vehicle_links import VehicleLinks
from app.services.webhooks import Webhooks, WebhookSettings
from app.storage import (
    Storage,
    Verification,
    no_journal,
    open_flight_log,
    open_storage,
    open_tokens,
    verify_journal,
)
from app.vehicles import (
    KeyFile,
    LinkKeyFiles,
    LinkSettings,
    MavsdkLinkSource,
    MemoryFile,
    SigningStore,
    SimulatorControlSocket,
    provide_cache_directory,
)
from app.webhooks import open_sender

if TYPE_CHECKING:
    from app.storage.postgres import ClusterStorage

log = structlog.get_logger(__name__)

SWITCH_S: Final = 0.0005
"""How long a thread that checks a plan keeps the interpreter from the event loop, which has setpoints to send. Python's
own 5 ms are a quarter of their period."""


async def serve(
    settings: Settings, *, on_ready: Callable[[str], None] = lambda url: None, start: Start | None = None
) -> None:
    """Run the service until SIGINT, SIGTERM or cancellation. `on_ready` gets the URL once it answers.

    `start` starts a part of a cluster instead of the whole service.

    Raises:
        SettingsError, StorageError, LinkError, ListenError: it could not start; what was begun is undone.
    """
    for variable, meant in misspelt_settings().items():
        log.warning("a variable or secret file is no setting and has no effect", name=variable, did_you_mean=meant)
    sys.setswitchinterval(SWITCH_S)
    async with _stop_signal() as stop, AsyncExitStack() as stack:
        try:
            url = await stack.enter_async_context((start or running)(settings))
        except asyncio.CancelledError:
            if not stop.ends_start():
                raise
            log.info("Waydrop stops before it has started")
            return
        stop.started()
        await stack.enter_async_context(hang_watch(settings.hang_exit_s))
        gc.freeze()  # everything created so far lives until the end: scanning it repeatedly would block the loop
        log.info("waydrop serves", url=url, version=__version__)
        on_ready(url)
        await stop.wait()
        log.info("Waydrop stops; vehicles continue to fly without it")


Start = Callable[[Settings], AbstractAsyncContextManager[str]]
Join = Callable[[Settings, Storage, GatewayServices], AbstractAsyncContextManager[SiteLease]]


@asynccontextmanager
async def running(settings: Settings, join: Join | None = None) -> AsyncIterator[str]:
    """The whole service, from its journal to its port, made a part of a cluster by `join`; yields its URL."""
    require_files(settings.max_connections)
    async with AsyncExitStack() as stack:
        claim_data_folder(settings.data_dir)
        storage = await stack.enter_async_context(_storage(settings))
        clock = SystemClock()
        access = access_to(storage.tokens, settings)
        require_access_control(settings, has_tokens=await access.has_tokens())
        threads = (await stack.enter_async_context(flight_threads())).run
        journal = await stack.enter_async_context(_journal(storage, clock))
        fleet, links = await stack.enter_async_context(_fleet(settings, journal, threads, joins=join is not None))
        targets = Targets(clock)
        known = KnownPlans(storage.plans, threads)
        plans = Plans(known, journal, clock, await stack.enter_async_context(plan_work(threads)))
        runs = await stack.enter_async_context(_runs(storage, fleet, plans, journal, targets))
        offboard = Offboard(fleet, runs, clock, _offboard_settings(settings), threads)
        stack.push_async_callback(offboard.close)
        webhooks = await stack.enter_async_context(webhooks_of(storage, journal, clock, settings))
        jobs = await stack.enter_async_context(_begun(Jobs(storage.jobs, plans, runs, fleet, journal, clock)))
        commands, rerouting = VehicleCommands(fleet, journal), Rerouting(runs, plans, threads)
        gateway = GatewayServices(fleet, commands, links, plans, runs, rerouting, jobs, targets, journal)
        lease = await stack.enter_async_context((join or _alone)(settings, storage, gateway))
        services = ApiServices(
            journal=journal,
            plans=plans,
            comparisons=Comparisons(runs, journal),
            attachments=Attachments(runs, storage.attachments, journal, clock),
            delivery_reports=_delivery_reports(runs, storage, journal, clock),
            access=access,
            fleet=fleet,
            runs=runs,
            rerouting=rerouting,
            jobs=jobs,
            targets=targets,
            commands=commands,
            links=links,
            offboard=offboard,
            tasks=Tasks(offboard, fleet, runs, clock),
            simulation=Simulation(_simulator_control(settings), fleet, runs, journal),
            webhooks=webhooks,
            answers=storage.answers,
            audit=await stack.enter_async_context(audit_of(storage, journal, clock)),
            loop_watch=LoopWatch(journal),
            clock=clock,
            site=lease,
        )
        yield await stack.enter_async_context(served(services, settings, storage.gateway_id))


@asynccontextmanager
async def served(services: ApiServices, settings: Settings, gateway_id: str) -> AsyncIterator[str]:
    """The services behind their port, with the event loop watched; yields the URL."""
    app = build_app(services, _api_settings(settings, gateway_id))
    tls = None
    if settings.tls_cert is not None and settings.tls_key is not None:
        tls = TlsFiles(settings.tls_cert, settings.tls_key)
    async with (
        services.loop_watch.watching(),  # before anybody is served: a stall right then is told, too
        serving(app, settings.host, settings.port, _limits(settings), tls) as url,
    ):
        yield url


def _delivery_reports(runs: Runs, storage: Storage, journal: Journal, clock: Clock) -> DeliveryReports:
    return DeliveryReports(runs, storage.plans, storage.attachments, journal, clock, storage.gateway_id)


@asynccontextmanager
async def open_access(settings: Settings, *, of_existing: bool = False) -> AsyncIterator[Access]:
    """The tokens alone, for the command line, also beside a running service: of a cluster if `postgres_url` is set.

    Raises StorageError; also if there is no journal, and it is to be `of_existing` one.
    """
    if of_existing and settings.postgres_url is None and not settings.journal_path.is_file():
        raise no_journal(settings.journal_path)
    claim_data_folder(settings.data_dir)
    if settings.postgres_url is not None:
        from app.storage.postgres import open_cluster_storage  # here: one machine needs no asyncpg

        async with open_cluster_storage(settings.postgres_url.get_secret_value(), key_file=key_file(settings)) as store:
            yield access_to(store.tokens, settings)
        return
    async with open_tokens(settings.journal_path) as tokens:
        yield access_to(tokens, settings)


def key_file(settings: Settings) -> Path:
    """The key of webhook secrets."""
    return settings.secret_key_file or settings.data_dir / "secret.key"


def link_keys(settings: Settings) -> LinkKeys:
    """The signing keys of this machine, for the command line, also beside a running service."""
    return LinkKeyFiles(KeyFile(settings.link_key_path), MemoryFile(settings.link_state_path))


async def verify(
    settings: Settings, anchors: Sequence[JournalHead], progress: Callable[[int, int], None]
) -> Verification:
    """Check this machine's journal, or the cluster's store if `postgres_url` is set, also beside a running service.

    Raises StorageError.
    """
    if settings.postgres_url is not None:
        from app.storage.postgres import verify_cluster  # here: one machine needs no asyncpg

        return await verify_cluster(settings.postgres_url.get_secret_value(), anchors, progress)
    return await verify_journal(settings.journal_path, anchors, progress)


async def replayed(settings: Settings, run_id: str) -> Replay:
    """A run of this machine's journal, decided again by today's code. Raises StorageError, NotFoundError."""
    async with open_flight_log(settings.journal_path) as flights:
        text = await flights.read(run_id)
    if not text:
        raise NotFoundError(
            f"no inputs of run {run_id!r} are stored", hint="inputs are stored for the newest 100 flown runs"
        )
    return replay(from_text(text))


def openapi_document() -> dict[str, Any]:
    """The OpenAPI 3.1 document of the REST interface, without a running service."""
    return describe(ROUTES, version=__version__)


@asynccontextmanager
async def _journal(storage: Storage, clock: Clock) -> AsyncIterator[Journal]:
    """The journal, which records the start and end of the service."""
    async with AsyncExitStack() as stack:
        journal = Journal(storage.events, clock)
        await journal.start()
        stack.push_async_callback(journal.close)
        await _record(journal, ServiceStarted(release=__version__))
        with suppress(StorageError):  # as in _record; it is still open at the next start, which records it
            await recover_interrupted(journal, clock)
        stack.push_async_callback(_record, journal, ServiceStopped())
        yield journal


@asynccontextmanager
async def _alone(settings: Settings, storage: Storage, gateway: GatewayServices) -> AsyncIterator[None]:
    """What a gateway of a cluster does in its own way."""
    async with retention_of(settings, storage.retention, gateway.journal, gateway.plans):
        yield


def retention_of(
    settings: Settings,
    store: RetentionStore,
    journal: EventJournal,
    plans: Plans,
    relayed: Callable[[], Awaitable[int]] | None = None,
) -> AbstractAsyncContextManager[None]:
    """Delete old data meanwhile, as the settings say."""
    periods = RetentionPeriods.of_days(settings.retention_days, settings.attachments_retention_days)
    retention = Retention(store, journal, SystemClock(), periods, plans_in_use=plans.in_use, relayed=relayed)
    return retention.running()


@asynccontextmanager
async def _runs(
    storage: Storage, fleet: Fleet, plans: Plans, journal: Journal, targets: Targets
) -> AsyncIterator[Runs]:
    runs = Runs(fleet, plans, storage.runs, journal, SystemClock(), storage.flight_log, targets=targets)
    try:
        await runs.begin()
        yield runs
    finally:
        await runs.close()


def access_to(tokens: TokenStore, settings: Settings) -> Access:
    """Who may use the service."""
    secret = settings.bootstrap_token
    return Access(tokens, SystemClock(), None if secret is None else secret.get_secret_value())


def _storage(settings: Settings) -> AbstractAsyncContextManager[Storage]:
    return open_storage(
        settings.journal_path,
        attachments_max_bytes=settings.attachments_max_bytes,
        key_file=settings.secret_key_file,
    )


def _limits(settings: Settings) -> ConnectionLimits:
    return ConnectionLimits(
        most=settings.max_connections,
        most_per_address=settings.max_connections_per_address,
        proxies=settings.trusted_proxies,
    )


def _simulator_control(settings: Settings) -> SimulatorControlSocket | None:
    if settings.simulator_control is None:
        return None
    host, _, port = settings.simulator_control.rpartition(":")
    return SimulatorControlSocket(host, int(port))


def _offboard_settings(settings: Settings) -> OffboardSettings:
    return OffboardSettings(
        rate_hz=settings.offboard_rate_hz, limits=settings.offboard_limits, gap_s=settings.offboard_gap_s
    )


@asynccontextmanager
async def _fleet(
    settings: Settings, journal: Journal, threads: InThread, *, joins: bool
) -> AsyncIterator[tuple[Fleet, VehicleLinks]]:
    """The vehicles, and what guards their links. Raises LinkKeyError, LinkError.

    `joins` a cluster: no open job begins before it is known whether another gateway has the site.
    """
    provide_cache_directory(settings.data_dir)
    keys, memory = KeyFile(settings.link_key_path), MemoryFile(settings.link_state_path)
    signing = SigningStore(keys, memory, in_thread=threads)
    source = MavsdkLinkSource(
        settings.connections, settings=LinkSettings(own_system_id=settings.system_id), signing=signing
    )
    log.info("waydrop looks for vehicles", connections=list(settings.connections))
    fleet = Fleet(source, journal, settings.vehicle_performance, settings.site)
    links = VehicleLinks(source, fleet, journal)
    if joins:
        fleet.gate_new_work(partial(SiteClaim().why_no_new_work, settings.site or ""))
        fleet.gate_commands(lambda: False)
    try:
        await fleet.start()
        await links.start()
        yield fleet, links
    finally:
        await links.close()
        await fleet.close()


@asynccontextmanager
async def webhooks_of(
    storage: Storage | ClusterStorage, journal: EventJournal, clock: Clock, settings: Settings
) -> AsyncIterator[Webhooks]:
    """The webhooks, being delivered. Raises StorageError."""
    how = WebhookSettings(http_anywhere=settings.webhook_http_anywhere)
    async with open_sender(version=__version__) as sender:
        webhooks = Webhooks(storage.webhooks, storage.plans, journal, sender, clock, storage.gateway_id, how)
        await webhooks.begin()
        try:
            yield webhooks
        finally:
            await webhooks.close()


@asynccontextmanager
async def audit_of(storage: Storage | ClusterStorage, journal: AuditedJournal, clock: Clock) -> AsyncIterator[Audit]:
    """The audit, being written."""
    audit = Audit(journal, storage.refusals, storage.tokens, clock)
    async with audit.recording():
        yield audit


@asynccontextmanager
async def _begun(jobs: Jobs) -> AsyncIterator[Jobs]:
    """The queue of jobs, begun; it is closed before the runs that it makes."""
    await jobs.begin()
    try:
        yield jobs
    finally:
        await jobs.close()


def _api_settings(settings: Settings, gateway_id: str) -> ApiSettings:
    return ApiSettings(
        gateway=gateway_id,
        version=__version__,
        web_root=settings.page_dir,
        maps=_map_settings(settings),
        allowed_hosts=settings.allowed_hosts,
        allowed_origins=settings.allowed_origins,
        trusted_proxies=settings.trusted_proxies,
        telemetry_period_s=settings.telemetry_period_s,
        max_body_bytes=settings.max_body_bytes,
        max_sockets=settings.max_sockets,
    )


def _map_settings(settings: Settings) -> MapSettings:
    return MapSettings(
        tile_url=settings.tile_url,
        tile_file=settings.tile_file,
        tile_attribution=settings.tile_attribution,
        styles=settings.basemap_styles,
        origins=settings.basemap_origins,
        satellite_url=settings.satellite_url,
        satellite_attribution=settings.satellite_attribution,
    )


async def _record(journal: Journal, payload: ServiceStarted | ServiceStopped) -> None:
    with suppress(StorageError):  # logged there; a full disk must not keep the service from stopping
        await journal.record(journal.new_event(payload))


class _Stop:
    """SIGINT or SIGTERM: they end the start, if it goes on, or the service."""

    def __init__(self) -> None:
        self._starting: asyncio.Task[None] | None = asyncio.current_task()
        self._came = asyncio.Event()

    def set(self) -> None:
        if self._starting is not None and not self._came.is_set():
            self._starting.cancel()
        self._came.set()

    def started(self) -> None:
        """From now on a signal cancels nothing."""
        self._starting = None

    def ends_start(self) -> bool:
        """Whether the start was cancelled by a signal, and by nothing else."""
        return self._starting is not None and self._came.is_set() and self._starting.uncancel() == 0

    async def wait(self) -> None:
        await self._came.wait()


@asynccontextmanager
async def _stop_signal() -> AsyncIterator[_Stop]:
    """What SIGINT and SIGTERM set, from before the start until all is closed: nothing else ends a container's PID 1."""
    stop, loop = _Stop(), asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    try:
        yield stop
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
