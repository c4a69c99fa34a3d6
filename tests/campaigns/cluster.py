"""The parts of a cluster fail while vehicles of two sites deliver: nothing is lost or doubled, and chains stay whole.

Usage: python -m tests.campaigns.cluster [--kills 100] [--rounds 5] [--only SCENE] [--seed N]

NATS, PostgreSQL, two gateways with two simulated vehicles each, and two API nodes run in processes of their own. All
the time dispatchers store plans and let each vehicle deliver, as runs and as jobs, through any API node; what is not
answered they send again with the same Idempotency-Key. Clients follow the stream of each API node, and come back with
`after`. The scenes, one after the other:

- kill: at random moments a random part is killed (kill -9; PostgreSQL: stopped immediately), and started again.
- store: NATS is killed, and what JetStream has stored is deleted.
- immediate: PostgreSQL is stopped immediately.

docs/explanation/campaigns.md says what counts as a failure. Exit status 1 if anything fell.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import aiohttp

from tests.campaigns.cluster_load import ANSWER_S, Found, Load, loaded
from tests.support.cluster_process import Cluster, running_cluster
from tests.support.entered import entered
from tests.support.service_process import Dispatcher, connects, until
from tests.support.whole_cluster import require_whole

FOUND_S: Final = 120.0
ARRIVED_S: Final = 120.0
BETWEEN_S: Final = 4.0
"""The next part is killed at most so long after the last one was started again."""
DOWN_S: Final = 1.5


@dataclass(frozen=True)
class Campaign:
    """A running cluster, its load, and what is known of it."""

    cluster: Cluster
    http: aiohttp.ClientSession
    load: Load
    chance: random.Random
    given: argparse.Namespace
    found: Found

    def say(self, scene: str, what: str) -> None:
        """A figure, for the end."""
        self.found.told.append(f"{scene}: {what}")

    async def arrived(self) -> float:
        """Wait until every follower was told of all that the gateways have recorded by now; how long that took."""
        began_s, heads = time.monotonic(), dict[str, int]()
        for gateway in self.cluster.gateways.values():
            async with self.http.ws_connect(f"{gateway.url}/api/v1/stream") as socket:
                hello = json.loads((await socket.receive()).data)
                heads[hello["gateway"]] = hello["seq"]

        async def missing() -> list[str]:
            return [
                f"{name}: {one.seqs.get(name, 0)} of {seq}"
                for one in self.load.followers
                for name, seq in heads.items()
                if one.seqs.get(name, 0) < seq
            ]

        await until(missing, lambda found: not found, "every client must be told of all events", ARRIVED_S)
        return time.monotonic() - began_s


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
    """NATS loses all that JetStream has acknowledged."""
    nats = campaign.cluster.nats

    def lose() -> None:
        nats.kill()
        nats.lose_store()

    await again_and_again(campaign, "store", ("NATS with its store", lose, nats.start))


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


Scene = Callable[[Campaign], Awaitable[None]]
SCENES: Final[dict[str, Scene]] = {"kill": kill, "store": store, "immediate": immediate}


def flown_twice(events: list[dict[str, Any]]) -> list[str]:
    """The plans with several runs that flew, or with several that no job made; each plan is asked for once.

    A job whose preparation a restart broke off gets another run.
    """
    flown, asked, jobs = set[tuple[str, str]](), list[str](), set[str]()
    for one in events:
        if one["kind"] == "job.changed":
            jobs.add(one["data"]["job"]["plan_id"])
        elif one["kind"] == "run.created":
            asked.append(one["data"]["plan_id"])
        elif one["kind"] == "run.changed" and one["data"]["state"] == "flying":
            flown.add((one["data"]["plan_id"], one["run_id"]))
    runs, flights = (
        Counter(plan_id for plan_id in asked if plan_id not in jobs),
        Counter(plan_id for plan_id, _ in flown),
    )
    return [f"plan {plan_id} has {count} runs" for plan_id, count in (*runs.items(), *flights.items()) if count > 1]


async def check(campaign: Campaign) -> None:
    """What was acknowledged is there, each request was carried out once, and all have all events."""
    cluster, found = campaign.cluster, campaign.found
    await campaign.arrived()
    events = await require_whole(cluster, campaign.http)
    found.events = len(events)
    for position, told in campaign.load.told.items():
        if events[position - 1]["hash"] != told:
            found.fell(f"the event at {position} is not the one that a client was told of")
    desks = [Dispatcher(campaign.http, node.url) for node in cluster.nodes]
    for number, (path, _) in enumerate(found.written.items()):
        try:
            await desks[number % len(desks)].get(path)
        except AssertionError as error:
            found.fell(f"acknowledged and lost: {error}")
    for how in flown_twice(events):
        found.fell(how)
    for part in (*cluster.gateways.values(), *cluster.nodes):
        if not connects(part.port):
            found.fell(f"{part.data_dir.name} has ended by itself: {part.log()}")
        for line in part.log_path.read_text(errors="replace").splitlines():
            if "Traceback" in line:
                found.fell(f"the log of {part.data_dir.name}: {line[:1500]}")


async def run(folder: Path, given: argparse.Namespace) -> Found:
    """The scenes that were chosen, under one load."""
    found, chance = Found(), random.Random(given.seed)
    async with AsyncExitStack() as stack:
        cluster = await entered(stack, running_cluster(folder, vehicles=2))
        timeout = aiohttp.ClientTimeout(total=ANSWER_S, sock_connect=ANSWER_S)
        http = await stack.enter_async_context(aiohttp.ClientSession(timeout=timeout))
        for node in cluster.nodes:
            await Dispatcher(http, node.url).until_vehicles(4, FOUND_S)
        try:
            async with loaded(cluster, http, chance, found) as load:
                campaign = Campaign(cluster, http, load, chance, given, found)
                for name in SCENES if given.only is None else [given.only]:
                    began_s = time.monotonic()
                    await SCENES[name](campaign)
                    print(f"{name}: {time.monotonic() - began_s:.0f} s", flush=True)
            await check(campaign)
        except (AssertionError, TimeoutError, aiohttp.ClientError) as error:
            found.fell(f"{error!r}")
    return found


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="the parts of a cluster fail under load")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=5, help="of each scene but kill")
    parser.add_argument("--only", choices=list(SCENES))
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="waydrop-cluster-campaign-") as folder:
        found = asyncio.run(run(Path(folder), given))
    print("\n".join([*found.failures[:50], *found.told]))
    for name in ("troubles", "answers", "outcomes"):
        print(f"{name}: {', '.join(f'{how}: {count}' for how, count in sorted(getattr(found, name).items()))}")
    print(f"{len(found.written)} acknowledged writes, {found.events} events: {len(found.failures)} failures")
    sys.exit(bool(found.failures or not found.events or not found.outcomes))


if __name__ == "__main__":
    main()
