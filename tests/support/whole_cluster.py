"""Whether a cluster has all that its gateways have recorded: each event once, in order, on every API node."""

from __future__ import annotations

from typing import Any

import aiohttp

from app.storage import verify_journal
from app.storage.postgres import verify_cluster
from tests.support.cluster_process import Cluster
from tests.support.service_process import Dispatcher, ServiceProcess, until

ARRIVED_S = 120.0


async def events_of(dispatcher: Dispatcher, after: int = 0) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    while page := (await dispatcher.get(f"/events?after={after}&limit=500"))["events"]:
        found += page
        after = page[-1]["position"]
    return found


async def require_whole(cluster: Cluster, http: aiohttp.ClientSession) -> list[dict[str, Any]]:
    """Every node has every event of every gateway once, in order, and tells the same; all chains are whole.

    The cluster's events. Raises AssertionError, which names the broken promise.
    """
    for site, gateway in cluster.gateways.items():
        chain = chain_of(await events_of(Dispatcher(http, gateway.url)))
        for node in cluster.nodes:
            await until(lambda node=node, chain=chain: _has(http, node, chain), bool, "nothing is lost", ARRIVED_S)  # type: ignore[misc]
        altered = (await verify_journal(gateway.data_dir / "waydrop.db")).alterations
        assert altered == [], f"the journal of {site} was altered"
    events = await events_of(Dispatcher(http, cluster.nodes[0].url))
    assert [event["position"] for event in events] == list(range(1, len(events) + 1)), "positions have no gap"
    for node in cluster.nodes[1:]:
        other = Dispatcher(http, node.url)
        await until(
            lambda other=other: events_of(other),  # type: ignore[misc]
            lambda found: found[: len(events)] == events,
            "every node tells the same",
            ARRIVED_S,
        )
    altered = (await verify_cluster(cluster.postgres_url)).alterations
    assert altered == [], "the cluster's store was altered"
    return events


def chain_of(events: list[dict[str, Any]], gateway: str = "") -> list[tuple[str, int, str]]:
    """The gateway, number and hash of each event of a gateway, of the first event's without one."""
    gateway = gateway or events[0]["gateway"]
    return [(event["gateway"], event["seq"], event["hash"]) for event in events if event["gateway"] == gateway]


async def _has(http: aiohttp.ClientSession, node: ServiceProcess, chain: list[tuple[str, int, str]]) -> bool:
    found = chain_of(await events_of(Dispatcher(http, node.url)), chain[0][0])
    assert [seq for _, seq, _ in found] == list(range(1, len(found) + 1)), "every event once, in order"
    return found[: len(chain)] == chain
