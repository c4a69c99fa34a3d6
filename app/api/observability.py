"""Prometheus metrics, and one structured log line per request."""

from __future__ import annotations

import re
import secrets
import time
from collections import Counter as Tally
from collections.abc import Iterator
from itertools import accumulate
from typing import Final

import structlog
from aiohttp import web
from aiohttp.typedefs import Handler, Middleware
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector

from app.api.ports import FleetApi, LinksApi
from app.domain.ports.journal import RunReader
from app.domain.run.run import RunState
from app.domain.vehicle.link_security import LinkSecurity
from app.services.access import Principal
from app.services.loop_watch import BOUNDS_S, LoopDelays

# One registry per application, so that two applications in a process do not share metrics.


CONTENT_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"


SOCKET_BOUNDS_S: Final = (1.0, 10.0, 60.0, 600.0, 3600.0, 21600.0, 86400.0)
SWITCHED: Final = 101
"""Switching Protocols: the response to a websocket's handshake."""
CANCELLED: Final = 0
"""In place of a status: the handler was cancelled before it responded."""


class Metrics:
    """Counts requests, and reads gauges from the fleet and the runs when scraped."""

    def __init__(self, fleet: FleetApi, runs: RunReader, delays: LoopDelays, links: LinksApi) -> None:
        self._registry = CollectorRegistry()
        self._requests = Counter(
            "waydrop_http_requests", "Requests answered", ("method", "route", "status"), registry=self._registry
        )
        self._seconds = Histogram("waydrop_http_request_seconds", "Response time", ("route",), registry=self._registry)
        self._socket_seconds = Histogram(
            "waydrop_websocket_seconds",
            "How long websockets were open",
            ("route",),
            buckets=SOCKET_BOUNDS_S,
            registry=self._registry,
        )
        self.sockets = Gauge("waydrop_websocket_clients", "Open websockets", registry=self._registry)
        self._closed = Counter(
            "waydrop_websocket_closed",
            "Websockets closed by the service, by close code",
            ("code",),
            registry=self._registry,
        )
        self._events = Counter("waydrop_events", "Events broadcast", ("kind",), registry=self._registry)
        self._registry.register(_Snapshot(fleet, runs, delays, links))

    def count_request(self, method: str, route: str, status: int, took_s: float) -> None:
        """Count a request. Unknown methods share one label, so that clients cannot exhaust memory with names.

        A websocket ends when its client leaves, and a cancelled request has no response: neither is a response time.
        """
        known = method if method in {"GET", "HEAD", "POST", "DELETE", "PUT", "PATCH", "OPTIONS"} else "other"
        self._requests.labels(known, route, str(status)).inc()
        if status == SWITCHED:
            self._socket_seconds.labels(route).observe(took_s)
        elif status != CANCELLED:
            self._seconds.labels(route).observe(took_s)

    def count_close(self, code: int) -> None:
        """Count a websocket that the service closed."""
        self._closed.labels(str(code)).inc()

    def count_event(self, kind: str) -> None:
        """Count an event that is broadcast to all sockets."""
        self._events.labels(kind).inc()

    def exposition(self) -> bytes:
        """Return the text exposition format."""
        return generate_latest(self._registry)


class _Snapshot(Collector):
    """Gauges that are read from the services at each scrape."""

    def __init__(self, fleet: FleetApi, runs: RunReader, delays: LoopDelays, links: LinksApi) -> None:
        self._fleet = fleet
        self._runs = runs
        self._delays = delays
        self._links = links

    def describe(self) -> Iterator[Metric]:
        """Nothing: registering must not read services that have not started."""
        return iter(())

    def collect(self) -> Iterator[Metric]:
        """Return runs by state and vehicles by link state."""
        runs = GaugeMetricFamily("waydrop_runs_open", "Unfinished runs, by state", labels=("state",))
        states = self._runs.open_states()
        for state in RunState:
            runs.add_metric([state.value], states.get(state, 0))
        yield runs
        vehicles = GaugeMetricFamily("waydrop_vehicles", "Known vehicles, by link state", labels=("link",))
        links = Tally(
            "quarantined" if view.quarantined else "connected" if view.state.connected else "lost"
            for view in self._fleet.vehicles()
        )
        for link in ("connected", "lost", "quarantined"):
            vehicles.add_metric([link], links[link])
        yield vehicles
        yield from self._guards()
        yield from self._loop()

    def _guards(self) -> Iterator[Metric]:
        """What the guards of the vehicle links let pass and refused. Labels are bounded by the configuration."""
        frames = CounterMetricFamily(
            "waydrop_link_frames", "MAVLink frames that passed a link guard", labels=("connection", "direction")
        )
        for relayed in self._links.relayed():
            frames.add_metric([relayed.connection, "from_vehicles"], relayed.from_vehicles)
            frames.add_metric([relayed.connection, "to_vehicles"], relayed.to_vehicles)
        yield frames
        refused = CounterMetricFamily(
            "waydrop_link_refused", "MAVLink frames that a link guard refused", labels=("connection", "reason")
        )
        for one in self._links.refused():
            refused.add_metric([one.connection, one.kind.value], one.count)
        yield refused
        secured = GaugeMetricFamily("waydrop_vehicle_links", "Known vehicles, by link security", labels=("security",))
        security = Tally(view.state.link_security for view in self._fleet.vehicles())
        for level in LinkSecurity:
            secured.add_metric([level.value], security[level])
        yield secured

    def _loop(self) -> Iterator[Metric]:
        """How late the event loop turns."""
        bounds = [*(f"{bound:g}" for bound in BOUNDS_S), "+Inf"]
        buckets = list(zip(bounds, accumulate(self._delays.counts), strict=True))
        delays = HistogramMetricFamily("waydrop_loop_delay_seconds", "How late the event loop turned, at each tick")
        delays.add_metric([], buckets, self._delays.sum_s)
        yield delays
        yield GaugeMetricFamily("waydrop_loop_delay_worst_seconds", "The longest since the start", self._delays.worst_s)


HEADER: Final = "X-Request-ID"
_GIVEN_ID: Final = re.compile(r"^[A-Za-z0-9._-]{1,64}$")
_ID: Final = web.RequestKey("request_id", str)
_PRINCIPAL: Final = web.RequestKey("principal", Principal)
_CODE: Final = web.RequestKey("code", str)
log = structlog.get_logger(__name__)


def request_id(request: web.Request) -> str:
    """Return the client's X-Request-ID if it is valid, else a new ID."""
    return request[_ID]


def note_principal(request: web.Request, principal: Principal) -> None:
    """Store the principal for the log line."""
    request[_PRINCIPAL] = principal


def principal_of(request: web.Request) -> Principal | None:
    """The authenticated principal, if any."""
    return request.get(_PRINCIPAL)


def note_code(request: web.Request, code: str) -> None:
    """Record the code of the problem that answers the request, for the log and the audit."""
    request[_CODE] = code


def code_of(request: web.Request) -> str | None:
    """The code of the problem that answers the request; None if it succeeded."""
    return request.get(_CODE)


def route_of(request: web.Request) -> str:
    """Return the pattern of the route (`/api/v1/runs/{run_id}`), which keeps the number of labels small."""
    resource = request.match_info.route.resource
    return resource.canonical if resource is not None else "unmatched"


def request_log(metrics: Metrics) -> Middleware:
    """The outermost middleware."""

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        given = request.headers.get(HEADER, "")
        request[_ID] = given if _GIVEN_ID.match(given) else secrets.token_hex(8)
        begun = time.perf_counter()
        status = CANCELLED
        try:
            response = await handler(request)
            status = response.status
            if not response.prepared:
                response.headers[HEADER] = request[_ID]
            return response
        finally:
            took_s = time.perf_counter() - begun
            metrics.count_request(request.method, route_of(request), status, took_s)
            log.info(
                "request",
                id=request[_ID],
                principal="-" if (principal := principal_of(request)) is None else principal.name,
                method=request.method,
                route=route_of(request),
                status=status,
                ms=round(took_s * 1000, 1),
            )

    return middleware
