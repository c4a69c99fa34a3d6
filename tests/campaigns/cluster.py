"""The parts of a cluster fail while vehicles of two sites deliver: nothing is lost or doubled, and chains stay whole.

Usage: python -m tests.campaigns.cluster [--only SCENE ...] [--kills 100] [--rounds 5] [--minutes 2] [--sockets 500]
           [--vehicles 2] [--seconds 0] [--seed N]

NATS, PostgreSQL, two gateways with simulated vehicles, and two API nodes run in processes of their own. All
the time dispatchers store plans and let each site's first vehicle deliver, as runs and as jobs, through any API node;
the other vehicles fly jobs that any site may fly. What is not answered is sent again with the same Idempotency-Key.
Clients follow the stream of each API node, and come back with `after`.
The scenes, one after the other, or those that --only names:

- kill: at random moments a random part is killed (kill -9; PostgreSQL: stopped immediately), and started again.
- store: NATS is killed while API nodes stand still, and what JetStream has stored and acknowledged is deleted.
- immediate: PostgreSQL is stopped immediately.
- cut: the gateway of a site is cut off from NATS for `--minutes`; its dispatchers go on at the gateway itself.
- sockets: an API node is killed under `--sockets` clients of its stream, which go on at the other one.
- owners: two gateways have a link to one vehicle and the name of one site; the one that has the site stands still for a
  while, so that both believe that they have it. What passes on their links, and what the vehicle does, is counted.

docs/explanation/campaigns.md says what counts as a failure. Exit status 1 if anything fell.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import sys
import tempfile
import time
from collections import Counter
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any, Final

import aiohttp

from tests.campaigns.cluster_load import ANSWER_S, Found, loaded
from tests.campaigns.cluster_owners import owners
from tests.campaigns.cluster_scenes import CUT, OF_PARTS, Campaign, Scene
from tests.support.cluster_process import running_cluster
from tests.support.cut_point import cut_point
from tests.support.entered import entered
from tests.support.service_process import Dispatcher, connects
from tests.support.whole_cluster import require_whole

FOUND_S: Final = 120.0
SCENES: Final[dict[str, Scene]] = {**OF_PARTS, "owners": owners}


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
    for event in events:
        if campaign.load.told.get(event["position"]) != event["hash"]:
            found.fell(f"the event at {event['position']} is not the one that clients were told of")
    dispatchers = [Dispatcher(campaign.http, node.url) for node in cluster.nodes]
    for number, (path, _) in enumerate(found.written.items()):
        try:
            await dispatchers[number % len(dispatchers)].get(path)
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


def room(sockets: int) -> dict[str, str]:
    """What API nodes need for so many sockets of one machine, and of the other node."""
    most = str(2 * sockets + 500)
    names = ("MAX_SOCKETS", "MAX_CONNECTIONS", "MAX_CONNECTIONS_PER_ADDRESS")
    return {f"WAYDROP_{name}": most for name in names}


def session() -> aiohttp.ClientSession:
    """Of all clients: it opens as many connections as they need."""
    timeout = aiohttp.ClientTimeout(total=ANSWER_S, sock_connect=ANSWER_S)
    return aiohttp.ClientSession(timeout=timeout, connector=aiohttp.TCPConnector(limit=0))


async def run(folder: Path, given: argparse.Namespace) -> Found:
    """The scenes that were chosen, under one load."""
    found, chance, begun_s = Found(), random.Random(given.seed), time.monotonic()
    async with AsyncExitStack() as stack:
        cluster = await entered(stack, running_cluster(folder, vehicles=given.vehicles, **room(given.sockets)))
        point = await stack.enter_async_context(cut_point(cluster.nats.port))
        await asyncio.to_thread(cluster.gateways[CUT].stop)
        cluster.gateways[CUT].set(WAYDROP_NATS_SERVERS=f"nats://127.0.0.1:{point.port}")
        await asyncio.to_thread(cluster.gateways[CUT].start)
        http = await stack.enter_async_context(session())
        for node in cluster.nodes:
            await Dispatcher(http, node.url).until_vehicles(2 * given.vehicles, FOUND_S)
        try:
            async with loaded(cluster, http, chance, found) as load:
                campaign = Campaign(cluster, http, load, chance, given, found, point)
                for name in given.only:
                    began_s = time.monotonic()
                    if found.troubles and given.seconds and began_s - begun_s > given.seconds:
                        print(f"{name} is left out: no time", flush=True)
                        continue
                    await SCENES[name](campaign)
                    print(f"{name}: {time.monotonic() - began_s:.0f} s", flush=True)
                await load.finish()
                await check(campaign)
        except (AssertionError, TimeoutError, aiohttp.ClientError) as error:
            found.fell(f"{error!r}")
    return found


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="the parts of a cluster fail under load")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=5, help="of the scenes store, immediate and owners")
    parser.add_argument("--minutes", type=float, default=2.0, help="how long a site is cut off")
    parser.add_argument("--sockets", type=int, default=500)
    parser.add_argument("--vehicles", type=int, default=2, help="at each site")
    parser.add_argument("--seconds", type=float, default=0.0, help="begin no further scene after so long")
    parser.add_argument("--only", nargs="+", choices=list(SCENES), default=list(SCENES), help="these scenes")
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="waydrop-cluster-campaign-") as folder:
        found = asyncio.run(run(Path(folder), given))
    print("\n".join(found.failures[:50]))
    for name in ("troubles", "answers", "outcomes"):
        print(f"{name}: {', '.join(f'{how}: {count}' for how, count in sorted(getattr(found, name).items()))}")
    print(f"{len(found.written)} acknowledged writes, {found.events} events: {len(found.failures)} failures")
    sys.exit(bool(found.failures or not found.events or not found.troubles))


if __name__ == "__main__":
    main()
