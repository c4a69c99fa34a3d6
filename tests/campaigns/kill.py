"""kill -9 at random moments under load: nothing acknowledged is lost, and no vehicle moves that would not have.

Usage: python -m tests.campaigns.kill [--kills 1000] [--seconds 0] [--services 3] [--seed N]

Each service runs in a process of its own, with three simulated vehicles. One stands on the ground with an uploaded run
that nobody starts, and a waiting job behind it. The others fly delivery after delivery: one with embedded drops, one
with supervised drops, as often as their runs end. Clients store plans without a pause; at a random moment the process
is killed and started again. Every other life lasts until a vehicle is in the air.

After each start: every plan that was answered with 201 is there; the events go on without a gap, a double or a change;
the run on the ground is uploaded, and its vehicle is not armed. Always, by what the simulator says: no vehicle is
armed more often than a client has asked for a start, a flight's modes are those of a flight without kills, and when it
is over its drop's outcome is what happened, or unknown. At the end the journal's chain is verified.
docs/explanation/campaigns.md says what counts as an unsafe move. Exit status 1 if anything fell.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import aiohttp

from app.storage import verify_journal
from tests.support.entered import entered
from tests.support.forked_service import ForkedService
from tests.support.judged_flights import DELIVERIES, OVER, SPEED, FlightJudge
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher
from tests.support.simulated import SimulatedFleet, free_udp_ports
from tests.support.simulator_truth import Truth, Truths, watched_truth

WRITERS: Final = 3
MOST_PLANS: Final = 12
"""So many plans of a life are acknowledged at most before the kill is due."""
LONGEST_WAIT_S: Final = 1.5
"""A kill that is due comes so much later at most: in the middle of anything."""
TAKEOFF_S: Final = 40.0
"""Every other life lasts until a vehicle is in the air, if that happens in time, and up to LONGEST_FLIGHT_S longer."""
LONGEST_FLIGHT_S: Final = 5.0
WRITTEN_S: Final = 60.0
LOOK_EVERY_S: Final = 0.2
PAGE: Final = 500
PLAN: Final[dict[str, Any]] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
DROPS: Final = {2: "embedded", 3: "supervised"}
"""By system id."""
FLEET: Final = "quad,quad,quad"


@dataclass
class Found:
    """What was acknowledged, what was seen, and what fell."""

    kills: int = 0
    plans: dict[str, str] = field(default_factory=dict)
    """Name by id of each plan that was answered with 201."""
    checked: int = 0
    """So many of them were read again after a later start."""
    events: list[str] = field(default_factory=list)
    """Hash of each event, from seq 1 on."""
    killed_in_air: int = 0
    """Vehicles that flew when their service was killed."""
    outcomes: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


async def store_plans(url: str, writer: int, found: Found) -> None:
    """Store plan after plan until the service is gone."""
    async with aiohttp.ClientSession() as http:
        for number in range(10_000):
            name = f"plan {found.kills} {writer} {number}"
            try:
                async with http.post(f"{url}/api/v1/plans", json={**PLAN, "name": name}) as answer:
                    body = await answer.json()
            except (aiohttp.ClientError, ConnectionError, json.JSONDecodeError):
                return  # killed: whether this one was stored is not known
            if answer.status == 201:
                found.plans[body["id"]] = name
            else:
                found.failures.append(f"POST /plans answered {answer.status}: {body}")


async def written(found: Found, count: int) -> None:
    """Wait until so many more plans are acknowledged: a kill before the first one would show nothing."""
    enough = len(found.plans) + count
    async with asyncio.timeout(WRITTEN_S):
        while len(found.plans) < enough:
            await asyncio.sleep(0.005)


def in_air(truths: Truths) -> int:
    """So many vehicles fly."""
    return sum(truth.armed and truth.height_m > 1 for truth in truths.by_id.values())


async def a_takeoff(truths: Truths) -> None:
    """Wait until a vehicle flies; not for ever, as all may have refused to start."""
    until_s = time.monotonic() + TAKEOFF_S
    while not in_air(truths) and time.monotonic() < until_s:
        await asyncio.sleep(0.05)


class Deliveries:
    """One vehicle's: a run after the other, over all lives of the service."""

    def __init__(self, system_id: int, truth: Truth, found: Found) -> None:
        self._id = system_id
        self._truth = truth
        self._found = found
        self._judge = FlightJudge(f"v{system_id}", truth, found.failures)
        self.judge_moves = self._judge.judge_moves
        self._run_id: str | None = None

    async def fly(self, url: str) -> None:
        """Until the service is gone."""
        async with aiohttp.ClientSession() as http:
            dispatcher = Dispatcher(http, url)
            try:
                waiting = await self._newest(dispatcher, "uploaded")
                while True:
                    if waiting is not None:  # killed before it was started: nothing starts by itself
                        await self._start_waiting(dispatcher, waiting["id"])
                        waiting = await self._newest(dispatcher, "uploaded")
                    await self._look(dispatcher)
                    await asyncio.sleep(LOOK_EVERY_S)
            except (aiohttp.ClientError, ConnectionError):
                return

    async def _newest(self, dispatcher: Dispatcher, state: str = "") -> dict[str, Any] | None:
        """The newest run of the vehicle, if it is in this state."""
        runs = (await dispatcher.get(f"/runs?vehicle=v{self._id}&limit=1"))["runs"]
        return next((run for run in runs if state in ("", run["state"])), None)

    async def _look(self, dispatcher: Dispatcher) -> None:
        newest = await self._newest(dispatcher)
        if newest is not None and newest["state"] not in OVER:
            self._run_id = newest["id"]
            return
        if self._truth.armed:
            return  # its run is over, and it is on its way home
        if self._run_id is not None and newest is not None and newest["id"] == self._run_id:
            self._found.outcomes[self._judge.judge_drop(newest)] += 1
            self._run_id = None
        await self._start(dispatcher)

    async def _start_waiting(self, dispatcher: Dispatcher, run_id: str) -> None:
        self._judge.asked += 1
        with contextlib.suppress(AssertionError):  # not seen again yet, or not ready: asked for again
            await dispatcher.post(f"/runs/{run_id}/start")

    async def _start(self, dispatcher: Dispatcher) -> None:
        self.judge_moves()
        self._truth.forget()
        plan = await dispatcher.post("/plans", DELIVERIES[DROPS[self._id]])
        self._judge.asked += 1
        try:
            run = await dispatcher.post("/runs", {"plan": plan["id"], "vehicle": f"v{self._id}", "start": True})
        except AssertionError:
            return  # not seen again yet, or not ready: refused, and asked for again
        self._run_id = run["id"]


async def check_plans(dispatcher: Dispatcher, found: Found) -> None:
    """Every acknowledged plan of the last lives is there as it was sent."""
    fresh = list(found.plans.items())[found.checked :]
    for plan_id, name in fresh:
        try:
            stored = await dispatcher.get(f"/plans/{plan_id}")
        except AssertionError as error:
            found.failures.append(f"acknowledged plan lost: {name}: {error}")
            continue
        if (stored.get("plan") or stored.get("document") or stored)["name"] != name:
            found.failures.append(f"acknowledged plan changed: {name}")
    found.checked += len(fresh)


async def check_events(dispatcher: Dispatcher, found: Found) -> None:
    """The last page that was seen is as it was, and what follows has no gap and no double."""
    after = max(0, len(found.events) - PAGE)
    while events := (await dispatcher.get(f"/events?after={after}&limit={PAGE}"))["events"]:
        for event in events:
            seq, known = event["seq"], len(found.events)
            if seq != after + 1:
                found.failures.append(f"event {after + 1} is missing or doubled: {seq} follows {after}")
            if seq <= known and found.events[seq - 1] != event["hash"]:
                found.failures.append(f"event {seq} changed")
            if seq == known + 1:
                found.events.append(event["hash"])
            after = seq


async def check_ground(dispatcher: Dispatcher, run_id: str, truth: Truth, found: Found) -> None:
    """Nobody started anything: the run waits, and its vehicle stands."""
    run = await dispatcher.get(f"/runs/{run_id}")
    if run["state"] != "uploaded":
        found.failures.append(f"the run that nobody started is {run['state']}: {run['reason']}")
    if truth.flights or truth.armed or truth.height_m > 0.5:
        found.failures.append(f"unsafe move: the vehicle of the run that nobody started is {truth}")


async def prepare(dispatcher: Dispatcher) -> str:
    """An uploaded run for one vehicle, and a job that waits behind it. The run's id."""
    await dispatcher.until_vehicles(1 + len(DROPS), 60)
    plan = await dispatcher.post("/plans", PLAN)
    run = await dispatcher.post("/runs", {"plan": plan["id"], "vehicle": "v1", "start": False})
    await dispatcher.until_run(run["id"], lambda one: one["state"] == "uploaded", "the run must be uploaded", 60)
    await dispatcher.post("/jobs", {"plan": plan["id"], "vehicle": "v1", "auto_start": True})
    return str(run["id"])


async def live_and_die(
    service: ForkedService, deliveries: list[Deliveries], truths: Truths, found: Found, chance: random.Random
) -> None:
    """One life of the service, from its start to the kill, and the next start."""
    clients = [asyncio.create_task(store_plans(service.url, n, found)) for n in range(WRITERS)]
    clients += [asyncio.create_task(each.fly(service.url)) for each in deliveries]
    await written(found, chance.randint(1, MOST_PLANS))
    if found.kills % 2:
        await a_takeoff(truths)
        await asyncio.sleep(chance.uniform(0.0, LONGEST_FLIGHT_S))
    else:
        await asyncio.sleep(chance.uniform(0.0, LONGEST_WAIT_S))
    found.killed_in_air += in_air(truths)
    await asyncio.to_thread(service.kill)
    found.kills += 1
    await asyncio.gather(*clients)
    await asyncio.to_thread(service.start)


async def campaign(folder: Path, port: int, kills: Iterator[int], seconds: float, chance: random.Random) -> Found:
    """One service: killed while there are kills left, and time, which begins when all is ready."""
    found, began_s = Found(), time.monotonic()
    async with AsyncExitStack() as stack:
        fleet = await entered(stack, SimulatedFleet(FLEET, speed=SPEED, port=port))
        service = await entered(stack, ForkedService(folder, fleet.connections))
        async with aiohttp.ClientSession() as http, watched_truth(fleet.control_port) as truths:
            dispatcher = Dispatcher(http, service.url)
            run_id = await prepare(dispatcher)
            until_s = time.monotonic() + (seconds or float("inf"))
            deliveries = [Deliveries(number, truths.by_id[number], found) for number in DROPS]
            for number in kills:
                await asyncio.to_thread(fleet.control, "battery_percent", 100.0)  # or they would be empty at some time
                await live_and_die(service, deliveries, truths, found, chance)
                await check_plans(dispatcher, found)
                await check_events(dispatcher, found)
                await check_ground(dispatcher, run_id, truths.by_id[1], found)
                for each in deliveries:
                    each.judge_moves()
                if number % 50 == 49:
                    print(f"{number + 1} kills after {time.monotonic() - began_s:.0f} s", flush=True)
                if time.monotonic() > until_s:
                    break
    verified = await verify_journal(folder / "waydrop.db")
    found.failures += [f"the journal was altered: {one}" for one in verified.alterations]
    return found


async def campaigns(folder: Path, given: argparse.Namespace) -> list[Found]:
    """Several services at once, which share the kills."""
    kills, vehicles = iter(range(given.kills)), len(FLEET.split(","))
    port = free_udp_ports(vehicles * given.services)
    return await asyncio.gather(
        *(
            campaign(
                *(folder / str(number), port + number * vehicles, kills, given.seconds),
                random.Random(f"{given.seed} {number}"),
            )
            for number in range(given.services)
        )
    )


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="kill -9 at random moments under load")
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=0.0, help="end after so long even with fewer kills")
    parser.add_argument("--services", type=int, default=3, help="so many at once, each with vehicles of its own")
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="waydrop-kill-") as folder:
        found = asyncio.run(campaigns(Path(folder), given))
    failures = [failure for one in found for failure in one.failures]
    kills, checked = sum(one.kills for one in found), sum(one.checked for one in found)
    killed_in_air = sum(one.killed_in_air for one in found)
    outcomes = sum((one.outcomes for one in found), Counter[str]())
    print("\n".join(failures[:50]))
    print(f"flights: {', '.join(f'{how}: {count}' for how, count in sorted(outcomes.items())) or 'none ended'}")
    print(
        f"{kills} kills, {killed_in_air} vehicles in the air at that moment, "
        f"{sum(len(one.plans) for one in found)} acknowledged plans, {checked} read again, "
        f"{sum(len(one.events) for one in found)} events: {len(failures)} failures"
    )
    sys.exit(bool(failures or kills == 0 or checked == 0 or (kills >= 2 * len(found) and killed_in_air == 0)))


if __name__ == "__main__":
    main()
