"""Two gateways that both believe they own a vehicle: each has a link to it, and the name of its site."""

from __future__ import annotations

import asyncio
import os
import shutil
import signal
import time
from contextlib import AsyncExitStack
from dataclasses import dataclass
from typing import Any, Final

import aiohttp

from app.domain.cluster.lease import LEASE_TTL_S
from tests.campaigns.cluster_scenes import Campaign
from tests.support.counted_link import CountedLink, counted_link
from tests.support.entered import entered
from tests.support.judged_flights import FLIGHT, SPEED
from tests.support.plan_pieces import gripper, land, plan_json, takeoff, waypoint
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet, free_udp_ports
from tests.support.simulator_truth import Truth, watched_truth
from tests.support.whole_cluster import events_of

SOON_S: Final = 120.0
HOLDS: Final = 6
DELIVERY: Final = plan_json("multicopter", takeoff(8), waypoint(12, 0, 8), gripper(hold_s=120), land(12))
FROZEN_S: Final = LEASE_TTL_S + 3.0
LANDED_S: Final = 240.0


@dataclass(frozen=True)
class Owner:
    """A gateway, and what passes on its link."""

    process: ServiceProcess
    link: CountedLink
    dispatcher: Dispatcher

    async def done(self) -> int:
        """How many commands its journal says it has carried out."""
        events = await events_of(self.dispatcher)
        return sum(one["kind"] == "vehicle.command" and one["data"]["outcome"] == "done" for one in events)


async def owners(campaign: Campaign) -> None:
    """In each round another site: the second gateway has data of its own, or a copy of the first one's.

    The other sites' vehicles land meanwhile.
    """
    campaign.load.stop()
    for number in range(campaign.given.rounds):
        is_copied = number % 2 == 1
        await one_site(campaign, f"east{number}", is_copied=is_copied)
        campaign.found.troubles[f"two owners, {'a copy' if is_copied else 'two journals'}"] += 1


async def one_site(campaign: Campaign, site: str, *, is_copied: bool) -> None:
    """Commands, a delivery, and commands again while the holder stands still and another one has its site."""
    folder = campaign.cluster.gateways["north"].data_dir.parent / site
    async with AsyncExitStack() as stack:
        ports = free_udp_ports(4)
        fleet = await entered(stack, SimulatedFleet("quad", speed=SPEED, port=ports, gcs_port=str(ports + 1)))
        truths = await stack.enter_async_context(watched_truth(fleet.control_port))
        links = [await stack.enter_async_context(counted_link(ports + way, ports + 2 + way)) for way in (0, 1)]
        processes = [
            ServiceProcess(
                folder / str(way),
                [f"udpin://127.0.0.1:{ports + 2 + way}"],
                part="gateway",
                **{
                    "WAYDROP_SITE": site,
                    "WAYDROP_SYSTEM_ID": str(245 + way),
                    "WAYDROP_STANDBY": "true",
                    **campaign.cluster.environment,
                },
            )
            for way in (0, 1)
        ]
        first, second = (
            Owner(process, link, Dispatcher(campaign.http, process.url))
            for process, link in zip(processes, links, strict=True)
        )
        await entered(stack, first.process)
        await first.dispatcher.until_vehicles(1, SOON_S)
        if is_copied:
            await asyncio.to_thread(first.process.stop)
            await asyncio.to_thread(shutil.copytree, folder / "0", folder / "1")
            await asyncio.to_thread(first.process.start)
        await until_lease(campaign.http, first, "held")
        await entered(stack, second.process)
        await second.dispatcher.until_vehicles(1, SOON_S)
        await until_lease(campaign.http, second, "taken")
        await contest(Contest(campaign, site, first, second, truths.by_id[1]))


@dataclass(frozen=True)
class Contest:
    """Both gateways are up and see the vehicle; the first one has the site."""

    campaign: Campaign
    site: str
    first: Owner
    second: Owner
    truth: Truth

    @property
    def vehicle_id(self) -> str:
        """The vehicle's, at both."""
        return f"{self.site}-v1"

    async def holds(self, count: int) -> list[int]:
        """So many commands at once, through all API nodes. The statuses of the answers."""
        nodes = self.campaign.cluster.nodes
        return await asyncio.gather(*(self._hold(nodes[number % len(nodes)].url) for number in range(count)))

    async def require_done(self, before: int, asked: int, answers: list[int], when: str) -> None:
        """Each answered command was carried out once, and no command twice."""
        done = await self.done() - before
        if not answers.count(202) <= done <= asked:
            self.fell(f"{when}: {asked} commands, answered with {answers}, were carried out {done} times")

    async def done(self) -> int:
        """By both gateways."""
        return await self.first.done() + await self.second.done()

    def fell(self, how: str) -> None:
        self.campaign.found.fell(f"owners of {self.site}: {how}")

    async def _hold(self, url: str) -> int:
        async with self.campaign.http.post(f"{url}/api/v1/vehicles/{self.vehicle_id}/hold", json={}) as answer:
            return answer.status


async def contest(both: Contest) -> None:
    """What is promised of the two."""
    node = Dispatcher(both.campaign.http, both.campaign.cluster.nodes[0].url)
    await until(lambda: node.get("/vehicles"), lambda told: knows(told, both.vehicle_id), "nodes know it", SOON_S)
    await both.require_done(await both.done(), HOLDS, await both.holds(HOLDS), "side by side")
    both.truth.forget()
    run = await node.until_over(await node.fly(DELIVERY, both.vehicle_id), LANDED_S)
    await until(lambda: armed(both.truth), lambda is_armed: not is_armed, "the vehicle must land", LANDED_S)
    flown, modes = (run["state"], run["drops"][0]["outcome"], both.truth.flights, both.truth.releases), both.truth.modes
    if flown != ("completed", "released", 1, 1) or modes != [mode for mode in FLIGHT if mode in modes]:
        both.fell(f"the delivery was {flown} in {modes}: {run['reason']}")
    if both.second.link.commands:
        both.fell(f"the second gateway has sent {dict(both.second.link.commands)}")
    await frozen(both)
    if (both.truth.flights, both.truth.releases) != (1, 1):
        both.fell(f"the vehicle flew {both.truth.flights} times and released {both.truth.releases} times")


async def frozen(both: Contest) -> None:
    """The holder stands still until its lease has expired, and goes on: both believe for a moment."""
    before, pid = await both.done(), both.first.process.pid
    os.kill(pid, signal.SIGSTOP)
    frozen_s = time.monotonic()
    try:
        early = asyncio.create_task(both.holds(2))
        await until_lease(both.campaign.http, both.second, "held")
        took_s = time.monotonic() - frozen_s
        await asyncio.sleep(max(0.0, FROZEN_S - took_s))
        late = await both.holds(2)
    finally:
        os.kill(pid, signal.SIGCONT)
    at_once = await both.holds(HOLDS)
    await until_lease(both.campaign.http, both.first, "taken")
    answers = [*await early, *late, *at_once, *await both.holds(HOLDS)]
    await both.require_done(before, len(answers), answers, "after a freeze")
    both.campaign.say(
        "owners", f"{both.site}: the second had the site {took_s:.1f} s after the holder froze; answers {answers}"
    )


async def until_lease(http: aiohttp.ClientSession, owner: Owner, state: str) -> None:
    """Wait until the gateway says so of its site."""

    async def told() -> Any:
        async with http.get(f"{owner.process.url}/healthz") as answer:
            return (await answer.json())["site_lease"]

    await until(told, state.__eq__, f"the lease must be {state}", SOON_S)


def knows(told: Any, vehicle_id: str) -> bool:
    """Whether a node has the vehicle, connected and with all that a run needs."""
    return any(one["id"] == vehicle_id and one["state"]["connected"] and one["uid"] for one in told["vehicles"])


async def armed(truth: Truth) -> bool:
    """Now."""
    return truth.armed
