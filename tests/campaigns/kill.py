"""kill -9 at random moments under load: nothing that was acknowledged is lost, and no vehicle moves.

Usage: python -m tests.campaigns.kill [--kills 1000] [--seconds 0] [--seed N]

The service runs in a process of its own, with two simulated vehicles that stand on the ground: one has an uploaded run
that nobody starts, and its queue has a waiting job. Clients store plans without a pause; at a random moment the process
is killed and started again. After each start: every plan that was answered with 201 is there; the events go on without
a gap, a double or a change; the run is uploaded, and neither vehicle is armed. At the end the journal's chain is
verified. docs/explanation/campaigns.md says what counts as an unsafe move. Exit status 1 if anything fell.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import aiohttp

from app.storage import verify_journal
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet

WRITERS: Final = 6
MOST_PLANS: Final = 20
"""So many plans of a life are acknowledged at most before the kill is due."""
LONGEST_WAIT_S: Final = 0.1
"""A kill that is due comes so much later at most: in the middle of anything."""
WRITTEN_S: Final = 60.0
PAGE: Final = 500
PLAN: Final[dict[str, Any]] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))


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


async def check_plans(desk: Dispatcher, found: Found) -> None:
    """Every acknowledged plan of the last lives is there as it was sent."""
    fresh = list(found.plans.items())[found.checked :]
    for plan_id, name in fresh:
        try:
            stored = await desk.get(f"/plans/{plan_id}")
        except AssertionError as error:
            found.failures.append(f"acknowledged plan lost: {name}: {error}")
            continue
        if (stored.get("plan") or stored.get("document") or stored)["name"] != name:
            found.failures.append(f"acknowledged plan changed: {name}")
    found.checked += len(fresh)


async def check_events(desk: Dispatcher, found: Found) -> None:
    """The last page that was seen is as it was, and what follows has no gap and no double."""
    after = max(0, len(found.events) - PAGE)
    while events := (await desk.get(f"/events?after={after}&limit={PAGE}"))["events"]:
        for event in events:
            seq, known = event["seq"], len(found.events)
            if seq != after + 1:
                found.failures.append(f"event {after + 1} is missing or doubled: {seq} follows {after}")
            if seq <= known and found.events[seq - 1] != event["hash"]:
                found.failures.append(f"event {seq} changed")
            if seq == known + 1:
                found.events.append(event["hash"])
            after = seq


async def check_ground(desk: Dispatcher, run_id: str, found: Found) -> None:
    """Nobody started anything: the run waits, and the vehicles that are heard stand."""
    run = await desk.get(f"/runs/{run_id}")
    if run["state"] != "uploaded":
        found.failures.append(f"the run that nobody started is {run['state']}: {run['reason']}")
    for vehicle in (await desk.get("/vehicles"))["vehicles"]:
        state = vehicle["state"]
        if state.get("armed") or state.get("landed_state") not in (None, "unknown", "on_ground"):
            found.failures.append(f"unsafe move: {vehicle['id']} is {state}")


async def prepare(desk: Dispatcher) -> str:
    """An uploaded run for one vehicle, and a job that waits behind it. The run's id."""
    await desk.until_vehicles(2)
    plan = await desk.post("/plans", PLAN)
    run = await desk.post("/runs", {"plan": plan["id"], "vehicle": "v1", "start": False})
    await desk.until_run(run["id"], lambda one: one["state"] == "uploaded", "the run must be uploaded", 60)
    await desk.post("/jobs", {"plan": plan["id"], "vehicle": "v1", "auto_start": True})
    return str(run["id"])


async def campaign(folder: Path, kills: int, seconds: float, chance: random.Random) -> Found:
    """Kill so often, or until the time is up."""
    found, began_s = Found(), time.monotonic()
    with SimulatedFleet("quad,quad") as fleet, ServiceProcess(folder, fleet.connections) as service:
        async with aiohttp.ClientSession() as http:
            run_id = await prepare(Dispatcher(http, service.url))
        while found.kills < kills and (not seconds or time.monotonic() - began_s < seconds):
            writers = [asyncio.create_task(store_plans(service.url, n, found)) for n in range(WRITERS)]
            await written(found, chance.randint(1, MOST_PLANS))
            await asyncio.sleep(chance.uniform(0.0, LONGEST_WAIT_S))
            await asyncio.to_thread(service.kill)
            found.kills += 1
            await asyncio.gather(*writers)
            await asyncio.to_thread(service.start)
            async with aiohttp.ClientSession() as http:
                desk = Dispatcher(http, service.url)
                await check_plans(desk, found)
                await check_events(desk, found)
                await check_ground(desk, run_id, found)
    verified = await verify_journal(folder / "waydrop.db")
    found.failures += [f"the journal was altered: {one}" for one in verified.alterations]
    return found


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="kill -9 at random moments under load")
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=0.0, help="end after so long even with fewer kills")
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="waydrop-kill-") as folder:
        found = asyncio.run(campaign(Path(folder), given.kills, given.seconds, random.Random(given.seed)))
    print("\n".join(found.failures[:50]))
    print(
        f"{found.kills} kills, {len(found.plans)} acknowledged plans, {found.checked} read again, "
        f"{len(found.events)} events: {len(found.failures)} failures"
    )
    sys.exit(bool(found.failures or found.kills == 0 or found.checked == 0))


if __name__ == "__main__":
    main()
