"""A gateway of `python -m bench.cluster`: generated vehicles; the journal, relay and reports are Waydrop's own.

Usage: python -m bench.cluster_gateway SITE FOLDER NATS_URL VEHICLES EVENTS_S

Each line of standard input is a command, answered by a JSON object on standard output: `idle`, `states` (vehicles are
reported at 5 Hz), `product` (and events are committed and relayed), `floor` (and they are committed to a second
journal, so that the disk has as much to do, and published by nats-py alone), `backlog N` (commit N events at once), and
`told` (when each event since the last `told` was committed).
"""

from __future__ import annotations

import asyncio
import json
import random
import sys
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from itertools import count
from pathlib import Path
from typing import Any, Final

import nats
from nats.js import JetStreamContext

from app.cluster import BusSettings, open_bus
from app.domain.cluster.ports import GatewaySite
from app.domain.events import NewEvent
from app.domain.events.run import RunCreated, RunItem
from app.domain.run.run import RunState
from app.domain.vehicle.state import VehicleState, VehicleType
from app.services.clock import SystemClock
from app.services.journal import Journal
from app.services.relay import Relay
from app.services.remote.fleet import Reporter
from app.services.views import StateView, VehicleView
from app.storage import Storage, open_storage
from tests.support.stored_samples import plan, run

PERIOD_S: Final = 0.2
AT_ONCE: Final = 100
"""Events of a backlog in one call of the journal."""
UNPUBLISHED: Final = 10_000


class GeneratedFleet:
    """Vehicles that move. `absolute_altitude_m` is the time of the state, so that a client can tell its age."""

    def __init__(self, site: str, vehicles: int) -> None:
        state = StateView.of(VehicleState(connected=True, latitude_deg=46.5, longitude_deg=7.5, position_age_s=0.05))
        self._views = [
            VehicleView(
                id=f"{site}-v{number}",
                system_id=1,
                vehicle_type=VehicleType.MULTICOPTER,
                firmware="PX4 1.16.0",
                uid=f"{site}{number:08x}",
                connection="udpin://127.0.0.1:14540",
                quarantined=None,
                run_id=f"run-{site}-{number}",
                performance=None,
                state=state,
            )
            for number in range(1, vehicles + 1)
        ]

    def vehicles(self) -> Sequence[VehicleView]:
        """As they are now."""
        moved = {"absolute_altitude_m": time.time(), "latitude_deg": 46.5 + random.random() / 100}
        return [view.model_copy(update={"state": view.state.model_copy(update=moved)}) for view in self._views]


class GeneratedGateway:
    """`journal` is relayed, `beside` is not."""

    def __init__(self, site: str, vehicles: int, events_s: float, journal: Journal, beside: Journal) -> None:
        self._site = site
        self._vehicles = vehicles
        self._period_s = 1.0 / events_s
        self._journal = journal
        self._beside = beside
        self._numbers = count()
        self._commits: list[tuple[str, int, float, float]] = []
        self.mode = "idle"
        self.begun = asyncio.Event()
        self.unpublished: asyncio.Queue[bytes] = asyncio.Queue(UNPUBLISHED)

    async def begin(self) -> None:
        """A run for each vehicle, in both journals."""
        for number in range(1, self._vehicles + 1):
            of = run().model_copy(
                update={
                    "id": f"run-{self._site}-{number}",
                    "vehicle_id": f"{self._site}-v{number}",
                    "state": RunState.FLYING,
                }
            )
            created = NewEvent.of(RunCreated(of), time.time(), vehicle_id=of.vehicle_id, run_id=of.id)
            for journal in (self._journal, self._beside):
                await journal.record(created, runs=(of,))

    async def commit(self) -> None:
        """Events at their rate, until cancelled. After a stand-still it makes up for what it missed."""
        due_s = time.monotonic() + random.random() * self._period_s  # gateways do not keep time together
        while True:
            await asyncio.sleep(max(0.0, due_s - time.monotonic()))
            due_s += self._period_s
            if self.mode == "product":
                (stored,) = await self._journal.record(self._event())
                self._commits.append((stored.gateway, stored.seq, time.time(), stored.time))
            elif self.mode == "floor":
                (stored,) = await self._beside.record(self._event())
                self._commits.append((stored.gateway, stored.seq, time.time(), stored.time))
                self.unpublished.put_nowait(stored.model_dump_json().encode())
            else:
                due_s = max(due_s, time.monotonic())

    async def backlog(self, events: int) -> dict[str, Any]:
        """Commit many events; the newest one."""
        for _ in range(0, events, AT_ONCE):
            stored = await self._journal.record(*(self._event() for _ in range(AT_ONCE)))
        return {"gateway": stored[-1].gateway, "last": stored[-1].seq}

    def commits(self) -> dict[str, Any]:
        """Gateway, number, time of the commit and its own time of each event since the last call."""
        commits, self._commits = self._commits, []
        return {"commits": commits}

    def _event(self) -> NewEvent:
        number = next(self._numbers)
        vehicle = number % self._vehicles + 1
        return NewEvent.of(
            RunItem(seq=number, phase="current", item_id=f"item-{number}"),
            time.time(),
            vehicle_id=f"{self._site}-v{vehicle}",
            run_id=f"run-{self._site}-{vehicle}",
        )


@asynccontextmanager
async def opened(path: Path) -> AsyncIterator[tuple[Storage, Journal]]:
    """A journal, begun."""
    async with open_storage(path) as storage:
        await storage.events.append((), plans=[plan()])
        journal = Journal(storage.events, SystemClock())
        await journal.start()
        try:
            yield storage, journal
        finally:
            await journal.close()


async def publish_bare(site: str, unpublished: asyncio.Queue[bytes], jetstream: JetStreamContext) -> None:
    """What nats-py alone does for a relay: one event after the other, each acknowledged."""
    for number in count():
        message = await unpublished.get()
        await jetstream.publish(f"floor.{site}", message, headers={"Nats-Msg-Id": f"{site}:{number}"})


async def report(gateway: GeneratedGateway, reporter: Reporter) -> None:
    """Waydrop's reports, once it is not idle any more."""
    await gateway.begun.wait()
    await reporter.run(PERIOD_S)


async def obey(gateway: GeneratedGateway) -> None:
    """Carry out each line, and answer it."""
    answer: dict[str, Any] = {}
    while True:
        sys.stdout.write(json.dumps(answer) + "\n")
        sys.stdout.flush()
        line = await asyncio.to_thread(sys.stdin.readline)
        if not line:
            return
        word, _, argument = line.strip().partition(" ")
        answer = {}
        if word == "backlog":
            answer = await gateway.backlog(int(argument))
        elif word == "told":
            answer = gateway.commits()
        else:
            gateway.mode = word
            if word != "idle":
                gateway.begun.set()


async def main(site: str, folder: Path, url: str, vehicles: int, events_s: float) -> None:
    """Until standard input ends."""
    async with (
        opened(folder / f"{site}-floor.db") as (_, beside),
        opened(folder / f"{site}.db") as (storage, journal),
        open_bus(BusSettings(servers=(url,), name=site)) as bus,
        Relay(site, storage.gateway_id, storage.relay_log, journal, bus).running(),
    ):
        gateway = GeneratedGateway(site, vehicles, events_s, journal, beside)
        await gateway.begin()
        client = await nats.connect(url, max_reconnect_attempts=-1, reconnect_time_wait=1)
        part = GatewaySite(gateway=storage.gateway_id, site=site, address=site)
        reporter = Reporter(part, "", GeneratedFleet(site, vehicles), journal, bus)
        work = (
            gateway.commit(),
            report(gateway, reporter),
            publish_bare(site, gateway.unpublished, client.jetstream()),
            obey(gateway),
        )
        tasks = [asyncio.create_task(one) for one in work]
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await client.close()
        for task in done:
            task.result()


if __name__ == "__main__":
    _, given_site, given_folder, given_url, given_vehicles, given_events_s = sys.argv
    asyncio.run(main(given_site, Path(given_folder), given_url, int(given_vehicles), float(given_events_s)))
