"""A running service for a test: a server on a socket of its own, and what stands behind it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import aiohttp
from aiohttp import web

from app.api import ApiServices, ApiSettings, build_app
from app.api.server import serving
from app.domain.offboard.step import DeadMan
from app.domain.webhooks.webhook import Backoff
from app.services.access import Access, Role
from app.services.attachments import Attachments
from app.services.audit import Audit
from app.services.clock import Clock, SystemClock
from app.services.delivery_reports import Comparisons, DeliveryReports
from app.services.fleet import Fleet
from app.services.jobs import Jobs, JobSettings
from app.services.journal import Journal
from app.services.loop_watch import LoopWatch
from app.services.offboard import Offboard, OffboardSettings
from app.services.plan_work import PlanWork, plan_work
from app.services.plans import KnownPlans, Plans
from app.services.runs import Runs
from app.services.runs.rerouting import Rerouting
from app.services.simulation import Simulation
from app.services.targets import Targets
from app.services.tasks import Tasks
from app.services.vehicle_commands import VehicleCommands
from app.services.vehicle_links import VehicleLinks
from app.services.webhooks import Webhooks, WebhookSettings
from app.storage.attachments import ATTACHMENTS_MAX_BYTES
from app.storage.storage import Storage, open_storage
from app.webhooks import open_sender
from tests.support.described import assert_described
from tests.support.fake_links import FakeLink
from tests.support.known_guards import KnownGuards
from tests.support.known_links import KnownLinks
from tests.support.patience import Patience

SETTINGS = ApiSettings(gateway="gw-test", version="0.0-test", telemetry_period_s=0.02)

PATIENT = OffboardSettings(lease_s=60.0, stream_s=0.2, gap_s=60.0, dead_man=DeadMan(max_age_s=20.0, gone_s=30.0))
"""On a busy machine a client of a test may be silent for long; dead-man and lease have tests of their own."""

PROMPT = WebhookSettings(backoff=Backoff(first_s=0.01, longest_s=0.05))
"""Webhooks that try again soon."""

LOOK_AGAIN_S = 0.05
"""Who waits for a run over REST asks so often: requests and the checks of their answers are not for nothing."""

LIVELY = JobSettings(poll_every_s=0.05, retry_after_s=0.05, late_for_s=0.05)
"""A queue that is looked at often."""


@dataclass(frozen=True)
class Service:
    """The server's address, a client without headers of its own, and the parts behind.

    With a `site`, the server is an API node, and the parts behind are those of the site's gateway.
    """

    port: int
    http: aiohttp.ClientSession
    links: tuple[FakeLink, ...]
    services: ApiServices
    storage: Storage
    app: web.Application
    guards: KnownGuards
    site: str | None = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def access(self) -> Access:
        return self.services.access

    def vehicle_id(self, number: int) -> str:
        """The vehicle of `links[number - 1]`."""
        return f"v{number}" if self.site is None else f"{self.site}-v{number}"

    @property
    def v1(self) -> str:
        return self.vehicle_id(1)

    @property
    def v2(self) -> str:
        return self.vehicle_id(2)

    async def token(self, role: Role) -> dict[str, str]:
        """Headers of a new token with this role; the first is named "a pilot", the next one "a pilot 2"."""
        name, taken = f"a {role.value}", {token.name for token in await self.services.access.list_tokens()}
        names = (name if number == 1 else f"{name} {number}" for number in count(1))
        _, secret = await self.services.access.create_token(next(one for one in names if one not in taken), role)
        return {"Authorization": f"Bearer {secret}"}

    async def call(self, method: str, path: str, **options: Any) -> tuple[int, Any, Any]:
        """Status, headers, and the body: data if it is JSON, else text. The answer is as the document describes it."""
        async with self.http.request(method, self.url + path, allow_redirects=False, **options) as response:
            is_json = response.content_type.endswith("json")
            body = await response.json(content_type=None) if is_json else await response.text()
            assert_described(method, path, response.status, response.content_type, body)
            return response.status, response.headers, body


@asynccontextmanager
async def run_service(
    folder: Path,
    *,
    settings: ApiSettings = SETTINGS,
    change: Callable[[ApiServices], ApiServices] = lambda services: services,
    bootstrap_token: str | None = None,
    hooks: WebhookSettings = PROMPT,
    webhook_timeout_s: float = 30.0,
    links: int = 2,
    jobs_settings: JobSettings = LIVELY,
    attachments_max_bytes: int = ATTACHMENTS_MAX_BYTES,
    access_clock: Clock | None = None,
    target_clock: Clock | None = None,
    site: str | None = None,
) -> AsyncIterator[Service]:
    """A service with some vehicles, a gateway if it has a site. `change` may put other services in before it starts."""
    clock, stack, vehicles = SystemClock(), AsyncExitStack(), tuple(FakeLink(n) for n in range(1, links + 1))
    file = await _journal_file(folder)
    async with open_storage(file, attachments_max_bytes=attachments_max_bytes) as storage:
        journal = Journal(storage.events, clock)
        fleet = Fleet(KnownLinks(*vehicles), journal, site=site)
        guards = KnownGuards()
        for begun in (journal, fleet):
            await begun.start()
        webhooks = await stack.enter_async_context(_webhooks(storage, journal, clock, hooks, webhook_timeout_s))
        access = Access(storage.tokens, access_clock or clock, bootstrap_token)
        guarded = VehicleLinks(guards, fleet, journal)
        targets = Targets(target_clock or clock)
        work = await stack.enter_async_context(plan_work())
        plain = _services(storage, clock, journal, fleet, webhooks, access, guarded, jobs_settings, targets, work)
        services = change(plain)
        try:
            await until(lambda: journal.last_seq >= links)  # each vehicle has been seen
            jobs, audit = plain.jobs, plain.audit
            assert isinstance(jobs, Jobs)
            assert isinstance(audit, Audit)
            await jobs.begin()
            async with audit.recording(), _served(services, settings, vehicles, storage, guards) as service:
                yield service
        finally:
            await stack.aclose()
            parts: tuple[Any, ...] = (plain.jobs, services.offboard, services.runs, fleet, journal)
            for part in parts:
                await part.close()


def _services(
    storage: Storage,
    clock: SystemClock,
    journal: Journal,
    fleet: Fleet,
    webhooks: Webhooks,
    access: Access,
    links: VehicleLinks,
    jobs_settings: JobSettings,
    targets: Targets,
    work: PlanWork,
) -> ApiServices:
    plans = Plans(KnownPlans(storage.plans), journal, clock, work)
    runs = Runs(fleet, plans, storage.runs, journal, clock, storage.flight_log, targets=targets)
    offboard = Offboard(fleet, runs, clock, PATIENT)
    return ApiServices(
        journal=journal,
        plans=plans,
        access=access,
        fleet=fleet,
        comparisons=Comparisons(runs, journal),
        attachments=Attachments(runs, storage.attachments, journal, clock),
        delivery_reports=DeliveryReports(runs, storage.plans, storage.attachments, journal, clock, storage.gateway_id),
        runs=runs,
        rerouting=Rerouting(runs, plans),
        targets=targets,
        jobs=Jobs(storage.jobs, plans, runs, fleet, journal, clock, jobs_settings),
        commands=VehicleCommands(fleet, journal),
        links=links,
        offboard=offboard,
        tasks=Tasks(offboard, fleet, runs, clock),
        simulation=Simulation(None, fleet, runs, journal),
        webhooks=webhooks,
        answers=storage.answers,
        audit=Audit(journal, storage.refusals, storage.tokens, clock),
        loop_watch=LoopWatch(journal),
        clock=clock,
    )


@asynccontextmanager
async def _webhooks(
    storage: Storage, journal: Journal, clock: SystemClock, settings: WebhookSettings, timeout_s: float
) -> AsyncIterator[Webhooks]:
    async with open_sender(version="0.0-test", total_s=timeout_s) as sender:
        webhooks = Webhooks(storage.webhooks, storage.plans, journal, sender, clock, storage.gateway_id, settings)
        await webhooks.begin()
        yield webhooks
        await webhooks.close()


_EMPTY_JOURNAL: list[bytes] = []
"""Made once: migrating a new file takes longer than most tests."""


async def _journal_file(folder: Path) -> Path:
    path = folder / "waydrop.db"
    if not path.exists():
        if not _EMPTY_JOURNAL:
            async with open_storage(path):
                pass
            _EMPTY_JOURNAL.append(path.read_bytes())
        path.write_bytes(_EMPTY_JOURNAL[0])
    return path


@asynccontextmanager
async def _served(
    services: ApiServices,
    settings: ApiSettings,
    links: tuple[FakeLink, ...],
    storage: Storage,
    guards: KnownGuards,
) -> AsyncIterator[Service]:
    app = build_app(services, replace(settings, gateway=storage.gateway_id))
    async with serving(app, "127.0.0.1", 0) as url, aiohttp.ClientSession(auto_decompress=True) as http:
        yield Service(urlsplit(url).port or 0, http, links, services, storage, app, guards)


async def until(condition: Callable[[], bool], *, timeout_s: float = 15.0) -> None:
    """Wait until something is so."""
    patience = Patience(timeout_s)
    while not condition():
        assert not patience.is_over(), f"it must be so within {timeout_s:g} s"
        await asyncio.sleep(0.005)
