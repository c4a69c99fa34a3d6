"""A whole cluster in processes of its own: NATS, PostgreSQL, gateways with simulated vehicles, API nodes."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.support.cluster_servers import PostgresDatabases, held_port, nats_server, postgres_databases
from tests.support.forked_service import ForkedService
from tests.support.service_process import ServiceProcess
from tests.support.simulated import SimulatedFleet
from tools.cluster_servers import NatsServer

SITES = ("north", "south")
SPEED = 4.0


@dataclass(frozen=True)
class Cluster:
    """Its parts. Each may be killed and started again. `environment` is what all of them share."""

    nats: NatsServer
    databases: PostgresDatabases
    gateways: dict[str, ServiceProcess]
    fleets: dict[str, SimulatedFleet]
    nodes: tuple[ServiceProcess, ...]
    postgres_url: str
    environment: dict[str, str]


@contextmanager
def running_cluster(
    folder: Path, *, sites: Sequence[str] = SITES, vehicles: int = 1, nodes: int = 2, **of_nodes: str
) -> Iterator[Cluster]:
    """A gateway at each site with so many quads, and API nodes, with variables of their own."""
    with ExitStack() as stack:
        databases = stack.enter_context(postgres_databases())
        nats = stack.enter_context(nats_server())
        url = databases.new()
        shared = {
            "WAYDROP_NATS_SERVERS": nats.url,
            "WAYDROP_CLUSTER_KEY": secrets.token_hex(32),
            "WAYDROP_OFFBOARD_GAP_S": "2.5",  # on a busy machine a healthy process may stand still for longer
        }
        gateways, fleets = {}, {}
        for site in sites:
            fleet = SimulatedFleet(",".join(["quad"] * vehicles), speed=SPEED)
            fleets[site] = stack.enter_context(fleet)
            port = stack.enter_context(held_port())
            own = {"WAYDROP_SITE": site, "WAYDROP_GATEWAY_URL": f"http://127.0.0.1:{port}"}
            gateway = ForkedService(folder / site, fleet.connections, part="gateway", port=port, **own, **shared)
            gateways[site] = stack.enter_context(gateway)
        own = {"WAYDROP_POSTGRES_URL": url, "WAYDROP_SECRET_KEY_FILE": str(folder / "secret.key"), **of_nodes}
        found = []
        for number in range(nodes):
            port = stack.enter_context(held_port())
            start = ForkedService if number else ServiceProcess  # one as users start it: all of it is imported
            node = start(folder / f"api-{number}", (), part="api", port=port, **own, **shared)
            found.append(stack.enter_context(node))
        yield Cluster(nats, databases, gateways, fleets, tuple(found), url, shared)
