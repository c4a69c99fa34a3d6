"""What /metrics tells Prometheus. One registry per application, so that two in a process do not mix."""

from __future__ import annotations

from collections import Counter as Tally
from collections.abc import Iterator
from typing import Final

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from app.domain.run import RunState
from app.services.fleet import Fleet
from app.services.runs import Runs

CONTENT_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"


class Metrics:
    """Counts what the API does, and looks at fleet and runs when asked."""

    def __init__(self, fleet: Fleet, runs: Runs) -> None:
        self._registry = CollectorRegistry()
        self._requests = Counter(
            "waydrop_http_requests", "Requests answered", ("method", "route", "status"), registry=self._registry
        )
        self._seconds = Histogram("waydrop_http_request_seconds", "Time to answer", ("route",), registry=self._registry)
        self.sockets = Gauge("waydrop_websocket_clients", "Open websockets", registry=self._registry)
        self._closed = Counter(
            "waydrop_websocket_closed", "Websockets closed by us, by close code", ("code",), registry=self._registry
        )
        self._events = Counter("waydrop_events", "Events sent out", ("kind",), registry=self._registry)
        self._registry.register(_Snapshot(fleet, runs))

    def count_request(self, method: str, route: str, status: int, took_s: float) -> None:
        """One request answered. Odd methods count as one, so that nobody can fill the memory with names."""
        known = method if method in {"GET", "HEAD", "POST", "DELETE", "PUT", "PATCH", "OPTIONS"} else "other"
        self._requests.labels(known, route, str(status)).inc()
        self._seconds.labels(route).observe(took_s)

    def count_close(self, code: int) -> None:
        """One websocket closed by us."""
        self._closed.labels(str(code)).inc()

    def count_event(self, kind: str) -> None:
        """One event on its way to all sockets."""
        self._events.labels(kind).inc()

    def exposition(self) -> bytes:
        """The text that Prometheus reads."""
        return generate_latest(self._registry)


class _Snapshot(Collector):
    """Gauges that are read off the services at the moment of asking."""

    def __init__(self, fleet: Fleet, runs: Runs) -> None:
        self._fleet = fleet
        self._runs = runs

    def describe(self) -> Iterator[Metric]:
        """Nothing ahead: registering must not look at services that have not started."""
        return iter(())

    def collect(self) -> Iterator[Metric]:
        """Runs by state, vehicles by link."""
        runs = GaugeMetricFamily("waydrop_runs_open", "Runs that are not over, by state", labels=("state",))
        states = Tally(run.state for run in self._runs.open_runs())
        for state in RunState:
            runs.add_metric([state.value], states[state])
        yield runs
        vehicles = GaugeMetricFamily("waydrop_vehicles", "Vehicles seen, by link", labels=("link",))
        links = Tally(
            "quarantined" if view.quarantined else "connected" if view.state.connected else "lost"
            for view in self._fleet.vehicles()
        )
        for link in ("connected", "lost", "quarantined"):
            vehicles.add_metric([link], links[link])
        yield vehicles
