"""Builds the aiohttp application out of the services."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping
from functools import cache

from aiohttp import web
from pydantic import BaseModel

from app.api.asyncapi import asyncapi_document
from app.api.body_room import BodyRoom
from app.api.boundary import answer_problems
from app.api.by_hand.frames import ClientDocument
from app.api.by_hand.sockets import ByHandEndpoint
from app.api.documents import DOCUMENTS, Documents, make_documents
from app.api.endpoint import HttpHandler, make_endpoint
from app.api.expectations import meet_expectation
from app.api.guard import Guard, guarded, is_handshake
from app.api.health import CHECKS, METRICS, VERSION
from app.api.idempotency import Idempotency
from app.api.metrics import Metrics
from app.api.openapi import openapi_document
from app.api.pages import Pages
from app.api.plan_exports import RENDERINGS
from app.api.pmtiles import Pmtiles
from app.api.renderings import Renderings
from app.api.request_log import request_log
from app.api.routes import ROUTES
from app.api.routing import API, BY_HAND_PATH, PROBED, TARGET_REPORTS_PATH
from app.api.security_headers import add_security_headers
from app.api.services import ApiServices, install
from app.api.settings import ApiSettings
from app.api.stream.broadcast import Broadcast
from app.api.stream.session import Sources
from app.api.stream.sockets import StreamEndpoint
from app.api.target_reports.frames import ReportFrame
from app.api.target_reports.sockets import ReportsEndpoint
from app.api.tiles import Tiles
from app.domain.validation import places_of


def build_app(services: ApiServices, settings: ApiSettings) -> web.Application:
    """The application. The services must have been started before it starts; stop them after it has been cleaned up.

    Serve it with `web.AppRunner(app, access_log=None)`: it logs its requests itself.
    """
    metrics = Metrics(services.fleet, services.runs)
    guard = Guard(settings.allowed_hosts, settings.allowed_origins)
    app = web.Application(
        middlewares=[request_log(metrics), answer_problems, guarded(guard, PROBED)],
        client_max_size=settings.max_body_bytes,
    )
    install(app, services)
    broadcast = Broadcast(services.journal, services.telemetry, services.clock, metrics)
    app[METRICS] = metrics
    app[VERSION] = settings.version
    app[RENDERINGS] = Renderings()
    app[CHECKS] = {"stream": broadcast.why_not_ready, **services.readiness}
    app[DOCUMENTS] = _documents(settings.version)
    _learn_places()
    by_hand = ByHandEndpoint(services.offboard, services.tasks, services.access, metrics, settings)
    app.on_shutdown.append(lambda _: by_hand.close())
    _add_routes(app, services, settings, {BY_HAND_PATH: by_hand.fly})
    _add_stream(app, services, settings, broadcast, metrics)
    reports = ReportsEndpoint(services.targets, services.access, metrics, settings)
    _add_socket(app, TARGET_REPORTS_PATH, reports.report)
    app.on_shutdown.append(lambda _: reports.close())
    tiles = Tiles(settings.tile_url, Pmtiles.opened(settings.tile_file), settings.tile_attribution)
    tiles.add_to(app)
    Pages(settings.web_root, tiles).add_to(app)
    app.on_response_prepare.append(add_security_headers)
    return app


@cache
def _documents(version: str) -> Documents:
    """Made once in a process, and before anything is served: half a second that no stream of setpoints may wait for."""
    return make_documents(openapi_document(ROUTES, version=version), asyncapi_document(version=version))


@cache
def _learn_places() -> None:
    """Where things stand in documents of each kind, for what is said of unfit ones: made ahead for the same reason."""
    asked: set[type[BaseModel]] = {model for route in ROUTES for model in (route.body.model, route.query)}
    for model in (*asked, ClientDocument, ReportFrame):
        places_of(model)


def _add_routes(
    app: web.Application, services: ApiServices, settings: ApiSettings, sockets: Mapping[str, HttpHandler]
) -> None:
    """`sockets`: at these paths of the table a websocket may be opened as well."""
    idempotency = Idempotency(services.answers, services.clock)
    room = BodyRoom(settings.bodies_under_way_bytes)
    for route in ROUTES:
        endpoint = make_endpoint(
            route,
            access=services.access,
            idempotency=idempotency,
            room=room,
            body_timeout_s=settings.body_timeout_s,
        )
        if route.method == "GET" and route.path in sockets:
            endpoint = _or_socket(endpoint, sockets[route.path])
        if route.method == "GET":
            app.router.add_get(route.path, endpoint, expect_handler=meet_expectation)  # takes HEAD too
        else:
            app.router.add_route(route.method, route.path, endpoint, expect_handler=meet_expectation)


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
    app.router.add_get(path, handler, allow_head=False, expect_handler=meet_expectation)


def _running(broadcast: Broadcast) -> Callable[[web.Application], AsyncIterator[None]]:
    async def run(_: web.Application) -> AsyncIterator[None]:
        broadcast.start()
        yield
        await broadcast.close()

    return run
