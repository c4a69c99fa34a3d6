"""The scenes of the campaign of a cluster: how its parts fail."""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import signal
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Final

import aiohttp

from tests.campaigns.cluster_load import Found, Load
from tests.support.cluster_process import Cluster
from tests.support.cut_point import CutPoint
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.stream_follower import StreamFollower

ARRIVED_S: Final = 120.0
BETWEEN_S: Final = 4.0
"""The next part is killed at most so long after the last one was started again."""
DOWN_S: Final = 1.5
STANDS_STILL_S: Final = 2.0
CUT: Final = "south"
CUT_OFF: Final = {"gateway.unreachable", "gateway.no_reply"}
OWN_ANSWER_S: Final = 10.0
ANSWERED_MINUTES: Final = 0.5
"""NATS takes a silent connection for a good one, so a command gets its answer late: a shorter cut has none."""
LOOK_EVERY_S: Final = 0.5
BACK_S: Final = 10.0
"""All clients of an API node that is killed are back at another one within this time."""


@dataclass(frozen=True)
class Campaign:
    """A running cluster, its load, and what is known of it."""

    cluster: Cluster
    http: aiohttp.ClientSession
    load: Load
    chance: random.Random
    given: argparse.Namespace
    found: Found
    cut_point: CutPoint
    """Between NATS and the gateway of CUT."""

    def say(self, scene: str, what: str) -> None:
        """A figure."""
        print(f"{scene}: {what}", flush=True)

    async def arrived(self, *more: StreamFollower) -> float:
        """Wait until every follower was told of all that the gateways have recorded by now; how long that took."""
        began_s = time.monotonic()
        heads = [await newest(self.http, gateway.url) for gateway in self.cluster.gateways.values()]

        async def missing() -> list[str]:
            return [
                f"{name}: {one.seqs.get(name, 0)} of {seq}"
                for one in (*self.load.followers, *more)
                for name, seq in heads
                if one.seqs.get(name, 0) < seq
            ]

        await until(missing, lambda found: not found, "every client must be told of all events", ARRIVED_S)
        return time.monotonic() - began_s


async def newest(http: aiohttp.ClientSession, url: str) -> tuple[str, int]:
    """The gateway, and its newest event."""
    async with http.ws_connect(f"{url}/api/v1/stream") as socket:
        hello = json.loads((await socket.receive()).data)
        return hello["gateway"], hello["seq"]


Part = tuple[str, Callable[[], object], Callable[[], object]]
"""Its name, how it ends, and how it starts again."""


def parts_of(cluster: Cluster) -> list[Part]:
    """All that can be killed."""
    postgres = cluster.databases.server
    return [
        *((f"gateway {site}", one.kill, one.start) for site, one in cluster.gateways.items()),
        *((f"API node {number}", one.kill, one.start) for number, one in enumerate(cluster.nodes)),
        ("NATS", cluster.nats.kill, cluster.nats.start),
        ("PostgreSQL", postgres.stop_immediately, postgres.start),
    ]


async def kill(campaign: Campaign) -> None:
    """Random parts at random moments."""
    parts = parts_of(campaign.cluster)
    for number in range(campaign.given.kills):
        await asyncio.sleep(campaign.chance.uniform(0.0, BETWEEN_S))
        await strike(campaign, *campaign.chance.choice(parts))
        if number % 20 == 19:
            print(f"{number + 1} kills", flush=True)
    await campaign.arrived()


async def store(campaign: Campaign) -> None:
    """NATS loses all that JetStream has acknowledged: API nodes stand still before that, or it would be stored."""
    nats, nodes = campaign.cluster.nats, campaign.cluster.nodes
    before = sum(asked_again(node) for node in nodes)

    def lose() -> None:
        for node in nodes:
            os.kill(node.pid, signal.SIGSTOP)
        time.sleep(STANDS_STILL_S)
        nats.kill()
        nats.lose_store()
        for node in nodes:
            os.kill(node.pid, signal.SIGCONT)

    await again_and_again(campaign, "store", ("NATS with its store", lose, nats.start))
    asked = sum(asked_again(node) for node in nodes) - before
    campaign.say("store", f"{asked} times gateways were asked again for what was lost")


def asked_again(node: ServiceProcess) -> int:
    """How often an API node has missed events that a gateway had published."""
    return node.log_path.read_text(errors="replace").count("asking a gateway again")


async def immediate(campaign: Campaign) -> None:
    """PostgreSQL ends without finishing anything."""
    server = campaign.cluster.databases.server
    await again_and_again(campaign, "immediate", ("PostgreSQL", server.stop_immediately, server.start))


async def again_and_again(campaign: Campaign, scene: str, part: Part) -> None:
    """One part, and each time until all that was recorded has arrived."""
    longest_s = 0.0
    for _ in range(campaign.given.rounds):
        await asyncio.sleep(campaign.chance.uniform(0.0, BETWEEN_S))
        await strike(campaign, *part)
        longest_s = max(longest_s, await campaign.arrived())
    campaign.say(scene, f"all events were with every client {longest_s:.1f} s after the part was started, or sooner")


async def strike(campaign: Campaign, name: str, end: Callable[[], object], start: Callable[[], object]) -> None:
    """End a part, and start it again a moment later."""
    for fleet in campaign.cluster.fleets.values():
        await asyncio.to_thread(fleet.control, "battery_percent", 100.0)  # or they would be empty at some time
    campaign.found.troubles[name] += 1
    await asyncio.to_thread(end)
    await asyncio.sleep(campaign.chance.uniform(0.0, DOWN_S))
    await asyncio.to_thread(start)
    campaign.load.judge()


async def cut(campaign: Campaign) -> None:
    """A site is cut off for minutes: its vehicles fly on, and its gateway serves it."""
    gateway, node = campaign.cluster.gateways[CUT], Dispatcher(campaign.http, campaign.cluster.nodes[0].url)
    local, vehicle_id = Dispatcher(campaign.http, gateway.url), f"{CUT}-v1"
    before, codes, ordered = await newest(campaign.http, gateway.url), set[str](), None
    until_s = time.monotonic() + 60.0 * campaign.given.minutes
    campaign.found.troubles["network of a site"] += 1
    with campaign.load.served_by(CUT, gateway.url):
        campaign.cut_point.cut()
        await until(
            lambda: node.get(f"/vehicles/{vehicle_id}"),
            lambda view: not view["state"]["connected"],
            "API nodes show its vehicles as disconnected",
            ARRIVED_S,
        )
        if campaign.given.minutes >= ANSWERED_MINUTES:
            ordered = asyncio.create_task(refusal(campaign.http, campaign.cluster.nodes[0].url, vehicle_id))
        was_seen = True
        while time.monotonic() < until_s:
            async with asyncio.timeout(OWN_ANSWER_S):
                view = await local.get(f"/vehicles/{vehicle_id}")
            if not (is_seen := view["state"]["connected"]) and not was_seen:  # once may be a busy machine
                campaign.found.fell(f"cut: the gateway itself does not see {vehicle_id} any more")
            was_seen = is_seen
            await asyncio.sleep(LOOK_EVERY_S)
        if ordered is not None:
            codes.add(await ordered)
        after = await newest(campaign.http, gateway.url)
        campaign.cut_point.heal()
    if not codes <= CUT_OFF:
        campaign.found.fell(f"cut: a command to the site that is cut off was answered with {codes}")
    took_s = await campaign.arrived()
    made = after[1] - before[1]
    if made <= 0:
        campaign.found.fell("cut: the gateway that was cut off has recorded nothing")
    campaign.say(
        "cut", f"{made} events behind the cut, all with every client {took_s:.1f} s after its end; {codes or ''}"
    )


async def refusal(http: aiohttp.ClientSession, url: str, vehicle_id: str) -> str:
    """The code with which a node refuses a command to a vehicle that is on its way anyway."""
    async with http.post(f"{url}/api/v1/job-queues/{vehicle_id}/resume", json={}) as answer:
        return "" if answer.ok else str((await answer.json())["code"])


async def sockets(campaign: Campaign) -> None:
    """An API node is killed under many sockets, which go on at the other one."""
    node, other = campaign.cluster.nodes
    count, load = campaign.given.sockets, campaign.load
    clients = [
        StreamFollower(campaign.http, [node.url, other.url], load.told, campaign.found.fell, load.followers[0])
        for _ in range(count)
    ]
    following = [asyncio.create_task(one.run(), name="socket") for one in clients]

    async def out() -> int:
        return sum(one.back_s is None or one.cuts != cuts for one in clients)

    try:
        cuts = 0
        await until(out, lambda left: left == 0, f"{count} sockets are open", ARRIVED_S)
        campaign.found.troubles["API node under sockets"] += 1
        cuts, killed_s = 1, time.monotonic()
        await asyncio.to_thread(node.kill)
        await until(out, lambda left: left == 0, "all sockets are back", ARRIVED_S)
        times_s = sorted(one.back_s - killed_s for one in clients if one.back_s is not None)
        if times_s[-1] > BACK_S:
            campaign.found.fell(f"sockets: the last one was back after {times_s[-1]:.1f} s, more than {BACK_S:.0f} s")
        await asyncio.to_thread(node.start)
        await campaign.arrived(*clients)
        half = times_s[count // 2]
        campaign.say(
            "sockets", f"{count} of a killed node, half of them back after {half:.1f} s, all {times_s[-1]:.1f} s"
        )
    finally:
        for task in following:
            task.cancel()
        await asyncio.gather(*following, return_exceptions=True)


Scene = Callable[[Campaign], Awaitable[None]]
OF_PARTS: Final[dict[str, Scene]] = {
    "kill": kill,
    "store": store,
    "immediate": immediate,
    "cut": cut,
    "sockets": sockets,
}
