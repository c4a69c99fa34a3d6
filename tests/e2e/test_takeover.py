"""A gateway takes over the vehicles of another one that is silent on their links, or when a person says so."""

from __future__ import annotations

import asyncio
import itertools
import json
import os
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from app.domain.cluster.lease import LEASE_TTL_S
from tests.support.cluster_process import Cluster, running_cluster
from tests.support.cluster_runs import ENDS, FLIGHT_S, require_delivered, run_or_none, until_run
from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet, free_udp_ports

PLAN = json.loads((PLANS / "clinic-run.json").read_text())
for _item in PLAN["items"]:
    if _item["type"] == "gripper":
        _item["hold_s"] = 600.0  # on a busy machine a takeover may take long; a release ends the hold at once
_corner = next(item for item in PLAN["items"] if item["id"] == "corner")
_detour = {**_corner, "id": "detour", "latitude_deg": _corner["latitude_deg"] + 0.0012}
del PLAN["geofence"]
PLAN["items"].insert(PLAN["items"].index(_corner), _detour)  # 130 m each way: the drop is far when a gateway is lost
NUMBERS = itertools.count(1)
"""Each pair has a site of its own: a run that one test leaves open is nothing to the next one."""
SOON_S = 120.0


@dataclass(frozen=True)
class Pair:
    """Two gateways of one site, each with a link of its own to the vehicle, and the API node of their cluster.

    The first has the site, the second not.
    """

    vehicle_id: str
    first: ServiceProcess
    second: ServiceProcess
    node: ServiceProcess
    fleet: SimulatedFleet


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """An API node, and no gateways but a pair's: those that only wait cost as much as those that fly."""
    with running_cluster(tmp_path_factory.mktemp("takeover"), sites=(), nodes=1) as running:
        yield running


@pytest.fixture(params=["forwarding", "apart"])
def started(request: pytest.FixtureRequest, cluster: Cluster, tmp_path: Path) -> Iterator[Pair]:
    """`forwarding`: the vehicle forwards what ground stations send between its links; `apart`: both have one id, so
    that neither can tell the other's HEARTBEAT from its own.
    """
    port, site = free_udp_ports(2), f"east{next(NUMBERS)}"
    second_id = "246" if request.param == "forwarding" else "245"
    with ExitStack() as stack:
        fleet = stack.enter_context(SimulatedFleet("quad", speed=4.0, port=port, gcs_port=str(port + 1)))
        gateways = [
            stack.enter_context(
                ForkedService(
                    tmp_path / system_id_of,
                    [f"udpin://127.0.0.1:{udp}"],
                    part="gateway",
                    WAYDROP_SITE=site,
                    WAYDROP_SYSTEM_ID=system_id,
                    WAYDROP_STANDBY="true",
                    WAYDROP_HANG_EXIT_S="0",  # on a busy machine one that is stopped may stand still for that long
                    **cluster.environment,
                )
            )
            for system_id_of, system_id, udp in (("first", "245", port), ("second", second_id, port + 1))
        ]
        yield Pair(f"{site}-v1", gateways[0], gateways[1], cluster.nodes[0], fleet)


@pytest.fixture
async def pair(started: Pair, http: aiohttp.ClientSession) -> Pair:
    """In the order of who has the site: a gateway serves before that is decided, so either may take it first."""

    async def states() -> tuple[str | None, str | None]:
        return await site_lease(http, started.first), await site_lease(http, started.second)

    decided = ("held", "taken"), ("taken", "held")
    found = await until(states, decided.__contains__, "one of two gateways takes the site", SOON_S)
    return started if found == decided[0] else replace(started, first=started.second, second=started.first)


async def site_lease(http: aiohttp.ClientSession, gateway: ServiceProcess) -> str | None:
    async with http.get(f"{gateway.url}/healthz") as answer:
        found: str | None = (await answer.json())["site_lease"]
        return found


async def until_lease(http: aiohttp.ClientSession, gateway: ServiceProcess, state: str, promise: str) -> None:
    await until(lambda: site_lease(http, gateway), state.__eq__, promise, SOON_S)


async def flying(http: aiohttp.ClientSession, pair: Pair) -> str:
    """A delivery through the API node that has taken off, as the node says; the second gateway has seen its vehicle."""
    node, second = Dispatcher(http, pair.node.url), Dispatcher(http, pair.second.url)
    await second.until_vehicles(1, within_s=SOON_S)
    await until(lambda: vehicles(node), lambda found: pair.vehicle_id in found, "the node shows the vehicle", SOON_S)
    run_id = await node.fly(PLAN, pair.vehicle_id)
    # 15 s on the vehicle's clock have passed: each gateway has heard several HEARTBEATs of the other one
    await node.until_run(run_id, lambda run: len(run["flown_item_ids"]) >= 1, "it is on its way", FLIGHT_S)
    return run_id


async def vehicles(node: Dispatcher) -> set[str]:
    return {one["id"] for one in (await node.get("/vehicles"))["vehicles"] if one["state"]["connected"]}


@pytest.mark.parametrize("started", ["forwarding"], indirect=True)
async def test_the_second_gateway_goes_on_with_the_delivery_of_one_that_was_killed(
    pair: Pair, http: aiohttp.ClientSession
) -> None:
    run_id = await flying(http, pair)
    await until_lease(http, pair.second, "taken", "the first one is heard, or it would be replaced at once")
    pair.first.kill()
    began_s = time.monotonic()
    await until_lease(http, pair.second, "held", "the second gateway takes the site over")
    took_s = time.monotonic() - began_s
    assert took_s > LEASE_TTL_S - 2.0, "not before the lease has expired and the first one is silent"

    await until_run(http, pair.second, run_id, ("flying", "at_drop"), "it goes on with the run")
    over = await Dispatcher(http, pair.second.url).until_over(run_id, FLIGHT_S)
    require_delivered(over)
    assert over["taken_over"]["number"] == 1
    node = Dispatcher(http, pair.node.url)
    shown = await node.until_run(run_id, lambda run: run["state"] == "completed", "the node shows the end", SOON_S)
    assert shown["taken_over"] == over["taken_over"]
    told = [event["kind"] for event in (await node.get(f"/runs/{run_id}/events?limit=500"))["events"]]
    assert told.count("run.taken_over") == 1

    pair.first.start()
    await until_lease(http, pair.first, "taken", "the first one learns that it has lost its site")
    assert (await Dispatcher(http, pair.first.url).get(f"/runs/{run_id}"))["state"] == "flying", "it follows it no more"
    await asyncio.to_thread(pair.second.stop)
    await until_lease(http, pair.first, "held", "it has its site again")
    again = await Dispatcher(http, pair.first.url).until_over(run_id, SOON_S)
    require_delivered(again)  # with the end of its run


@pytest.mark.parametrize("started", ["forwarding"], indirect=True)
async def test_a_gateway_that_stood_still_commands_nothing_when_it_wakes(
    pair: Pair, http: aiohttp.ClientSession
) -> None:
    run_id = await flying(http, pair)
    os.kill(pair.first.pid, signal.SIGSTOP)
    await until_lease(http, pair.second, "held", "the second gateway takes the site over")
    os.kill(pair.first.pid, signal.SIGCONT)
    await until_lease(http, pair.first, "taken", "it learns that it has lost its site")
    await until_run(http, pair.second, run_id, ENDS, "the second gateway ends the run")
    over = await Dispatcher(http, pair.second.url).until_over(run_id, FLIGHT_S)
    require_delivered(over)
    assert await releases_of(http, pair.first, run_id) + await releases_of(http, pair.second, run_id) == 1


async def releases_of(http: aiohttp.ClientSession, gateway: ServiceProcess, run_id: str) -> int:
    """How often the gateway has ordered a release in this run."""
    events = (await Dispatcher(http, gateway.url).get(f"/runs/{run_id}/events?limit=500"))["events"]
    ordered = [event["data"] for event in events if event["kind"] == "run.command"]
    return sum(data["command"] == "DO_GRIPPER" and data["action"] is None for data in ordered)


def is_found(run: Any) -> bool:
    """Whether the gateway follows the run, which it has taken over."""
    return run is not None and run["taken_over"] is not None and run["taken_over"]["is_found"]


async def left_by_takeover(http: aiohttp.ClientSession, gateway: ServiceProcess) -> list[str] | None:
    """A person lets this gateway take the site over: the runs left. None if the site was not taken in time, and is not
    yet: a person tries again.
    """
    async with http.post(f"{gateway.url}/api/v1/site/take-over", json={}) as answer:
        found = await answer.json()
    if answer.status == 200:
        assert found["site_lease"] == "held"
        left: list[str] = found["left_run_ids"]
        return left
    if found["code"] == "state.conflict":
        assert await site_lease(http, gateway) == "held", "only an earlier attempt has left nothing to take over"
        return []
    assert found["code"] == "gateway.no_reply", found
    return None


@pytest.mark.parametrize("started", ["apart"], indirect=True)
async def test_without_proof_on_the_link_a_person_decides(pair: Pair, http: aiohttp.ClientSession) -> None:
    run_id = await flying(http, pair)
    node, second = Dispatcher(http, pair.node.url), Dispatcher(http, pair.second.url)
    await node.post(f"/runs/{run_id}/pause")  # a person may take long, and a drop begun meanwhile is not commanded
    await until_run(http, pair.node, run_id, ("paused",), "the vehicle waits for the person")
    pair.first.kill()
    await until_lease(http, pair.second, "expired", "the lease expires, and nothing is taken over")
    plan = await second.post("/plans", PLAN)
    async with http.post(
        f"{pair.second.url}/api/v1/runs", json={"plan": plan["id"], "vehicle": pair.vehicle_id}
    ) as answer:
        assert (answer.status, (await answer.json())["code"]) == (409, "cluster.site_taken")
    left = await until(
        lambda: left_by_takeover(http, pair.second), lambda found: found is not None, "it takes the site", SOON_S
    )
    assert set(left) <= {run_id}
    assert await site_lease(http, pair.second) == "held"
    await until(lambda: run_or_none(http, pair.second, run_id), is_found, "a run that is left is tried again", FLIGHT_S)
    await second.post(f"/runs/{run_id}/resume")
    over = await second.until_over(run_id, FLIGHT_S)
    require_delivered(over)
