"""Builds the aiohttp application from the services."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from functools import cache
from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api import (
    attachments,
    audit,
    conversions,
    delivery_reports,
    documents,
    events,
    health,
    jobs,
    plans,
    principal,
    run_changes,
    runs,
    simulator,
    site,
    targets,
    tasks,
    vehicles,
    webhooks,
)
from app.api.asyncapi import asyncapi_document
from app.api.audit import audited
from app.api.authentication import PUBLIC, authenticate, require_role
from app.api.bodies import NUL, BodyMemory, check_head, meet_expectation, read_body, read_query
from app.api.conversions import RENDERINGS, Renderings
from app.api.cors import Cors
from app.api.documents import DOCUMENTS, Documents, EncodedDocuments, encode
from app.api.gateways import elsewhere
from app.api.guard import Guard, add_security_headers, guarded, is_handshake
from app.api.health import CHECKS, METRICS, VERSION
from app.api.idempotency import Idempotency, request_hash
from app.api.observability import Metrics, note_principal, request_log
from app.api.offboard import routes
from app.api.offboard.frames import ClientDocument
from app.api.offboard.session import OffboardEndpoint
from app.api.openapi import openapi_document
from app.api.pages import Pages
from app.api.problems import answer_problems
from app.api.proxies import TrustedProxies, behind_proxies
from app.api.routing import API, OFFBOARD_PATH, PROBED, TARGET_REPORTS_PATH, Call, Route
from app.api.services import ApiServices, install
from app.api.settings import ApiSettings
from app.api.stream.session import Broadcast, Sources, StreamEndpoint
from app.api.target_reports import ReportFrame, ReportsEndpoint
from app.api.tiles import Maps, Pmtiles
from app.domain.errors import NotFoundError
from app.domain.validation import places_of
from app.services.access import Access, Principal
from app.services.background import background

ROUTES: Final[tuple[Route, ...]] = (
    *vehicles.ROUTES,
    *routes.ROUTES,
    *tasks.ROUTES,
    *plans.ROUTES,
    *conversions.ROUTES,
    *runs.ROUTES,
    *run_changes.ROUTES,
    *targets.ROUTES,
    *jobs.ROUTES,
    *delivery_reports.ROUTES,
    *attachments.ROUTES,
    *events.ROUTES,
    *webhooks.ROUTES,
    *simulator.ROUTES,
    *principal.ROUTES,
    *site.ROUTES,
    *audit.ROUTES,
    *documents.ROUTES,
    *health.ROUTES,
)

PREPARE_AFTER_S: Final = 1.0
LARGE_BYTES: Final = 4 * 1024
"""A larger body is parsed in a thread: parsing it on the event loop would delay setpoints to vehicles."""
HttpHandler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def make_endpoint(
    route: Route, *, access: Access, idempotency: Idempotency, body_memory: BodyMemory, body_timeout_s: float
) -> HttpHandler:
    """Return the handler that aiohttp calls for a route. It makes every check that the route declares."""

    async def endpoint(request: web.Request) -> web.StreamResponse:
        principal = await _principal(route, request, access)
        if NotFoundError.code in route.errors and any(NUL in value for value in request.match_info.values()):
            raise NotFoundError("no ID has a NUL character", hint="list the resources to see their IDs")
        query = read_query(request, route.query)
        if route.method == "GET":
            return await answer(request, principal, query, b"")
        largest_bytes = route.body.max_bytes or request.client_max_size
        check_head(request, route.body, most_bytes=largest_bytes)
        if route.before_body is not None:
            await route.before_body(request)
        with body_memory.held(request, largest_bytes):
            raw = await read_body(request, route.body, timeout_s=body_timeout_s)
            return await answer(request, principal, query, raw)

    async def answer(request: web.Request, principal: Principal, query: BaseModel, raw: bytes) -> web.StreamResponse:
        body = await asyncio.to_thread(route.body.parse, raw) if len(raw) > LARGE_BYTES else route.body.parse(raw)
        if not route.is_idempotent:
            return await route.handler(Call(request, principal, query, body))
        return await idempotency.answer(
            request,
            principal,
            request_hash(request, raw),
            lambda keyed: route.handler(Call(request, principal, query, body, keyed)),
            is_urgent=route.is_urgent,
        )

    return endpoint


async def _principal(route: Route, request: web.Request, access: Access) -> Principal:
    if route.role is None:
        note_principal(request, PUBLIC)
        return PUBLIC
    principal = await authenticate(request, access)
    note_principal(request, principal)  # including those without permission
    require_role(principal, route.role)
    return principal


def build_app(services: ApiServices, settings: ApiSettings) -> web.Application:
    """Build the application. Start the services before it, and stop them after its cleanup.

    Serve it with `web.AppRunner(app, access_log=None)`: it logs requests itself.
    """
    metrics = Metrics(services.fleet, services.runs, services.loop_watch.delays, services.links)
    guard, cors = Guard(settings.allowed_hosts, settings.allowed_origins), Cors(settings.allowed_origins)
    app = web.Application(
        middlewares=[
            behind_proxies(TrustedProxies(settings.trusted_proxies)),
            request_log(metrics),
            audited(services.audit, ROUTES),
            answer_problems,
            guarded(guard, PROBED),
            cors.preflights,
        ],
        client_max_size=settings.max_body_bytes,
    )
    install(app, services)
    broadcast = Broadcast(services.journal, services.fleet, services.clock, metrics, settings.telemetry_period_s)
    app[METRICS] = metrics
    app[VERSION] = settings.version
    app[RENDERINGS] = Renderings(services.plans.work)
    app[CHECKS] = {"stream": broadcast.why_not_ready, **services.readiness}
    app[DOCUMENTS] = Documents(lambda: _documents(settings.version))
    app.cleanup_ctx.append(_prepared)
    _add_routes(app, services, settings, _offboard_sockets(app, services, metrics, settings))
    _add_stream(app, services, settings, broadcast, metrics)
    reports = ReportsEndpoint(services.targets, services.access, metrics, settings)
    _add_socket(app, TARGET_REPORTS_PATH, reports.report)
    app.on_shutdown.append(lambda _: reports.close())
    maps = Maps(settings.maps, Pmtiles.opened(settings.maps.tile_file))
    maps.add_to(app)
    Pages(settings.web_root, maps).add_to(app)
    app.on_response_prepare.append(add_security_headers)
    app.on_response_prepare.append(cors.add_headers)
    return app


@cache
def _documents(version: str) -> EncodedDocuments:
    """Built once per process."""
    return encode(openapi_document(ROUTES, version=version), asyncapi_document(version=version))


async def _prepared(_: web.Application) -> AsyncIterator[None]:
    """Build the locations in a thread once the service is ready: each takes longer than a turn of the loop may."""

    async def prepare() -> None:
        await asyncio.sleep(PREPARE_AFTER_S)
        await asyncio.to_thread(_learn_places)

    async with background(prepare(), "JSON locations"):
        yield


@cache
def _learn_places() -> None:
    """JSON locations for each kind of document, used in validation errors."""
    asked: set[type[BaseModel]] = {model for route in ROUTES for model in (route.body.model, route.query)}
    for model in (*asked, ClientDocument, ReportFrame):
        places_of(model)


def _add_routes(
    app: web.Application, services: ApiServices, settings: ApiSettings, sockets: Mapping[str, HttpHandler]
) -> None:
    """Add the routes. `sockets`: paths of the table that accept a websocket as well."""
    idempotency = Idempotency(services.answers, services.claims)
    body_memory = BodyMemory(settings.bodies_under_way_bytes)
    for route in ROUTES:
        is_elsewhere = services.offboard is None and route in (*routes.ROUTES, *tasks.ROUTES)
        endpoint = make_endpoint(
            dataclasses.replace(route, handler=elsewhere) if is_elsewhere else route,
            access=services.access,
            idempotency=idempotency,
            body_memory=body_memory,
            body_timeout_s=settings.body_timeout_s,
        )
        if route.method == "GET" and route.path in sockets:
            endpoint = _or_socket(endpoint, sockets[route.path])
        if route.method == "GET":
            app.router.add_get(route.path, endpoint, expect_handler=meet_expectation)  # accepts HEAD as well
        else:
            app.router.add_route(route.method, route.path, endpoint, expect_handler=meet_expectation)


def _offboard_sockets(
    app: web.Application, services: ApiServices, metrics: Metrics, settings: ApiSettings
) -> Mapping[str, HttpHandler]:
    """The socket of offboard control, where the vehicles are."""
    if services.offboard is None or services.tasks is None:
        return {}
    offboard = OffboardEndpoint(services.offboard, services.tasks, services.access, services.audit, metrics, settings)
    app.on_shutdown.append(lambda _: offboard.close())
    return {OFFBOARD_PATH: offboard.fly}


def _or_socket(endpoint: HttpHandler, socket: HttpHandler) -> HttpHandler:
    async def either(request: web.Request) -> web.StreamResponse:
        return await (socket if is_handshake(request) else endpoint)(request)

    return either


def _add_stream(
    app: web.Application, services: ApiServices, settings: ApiSettings, broadcast: Broadcast, metrics: Metrics
) -> None:
    sources = Sources(services.journal, services.fleet, services.runs, services.clock, broadcast)
    endpoint = StreamEndpoint(sources, services.access, metrics, settings)
    _add_socket(app, f"{API}/stream", endpoint.stream)
    app.cleanup_ctx.append(_running(broadcast))
    app.on_shutdown.append(lambda _: endpoint.close())


def _add_socket(app: web.Application, path: str, handler: HttpHandler) -> None:
    app.router.add_get(path, handler, expect_handler=meet_expectation)


def _running(broadcast: Broadcast) -> Callable[[web.Application], AsyncIterator[None]]:
    async def run(_: web.Application) -> AsyncIterator[None]:
        broadcast.start()
        yield
        await broadcast.close()

    return run
