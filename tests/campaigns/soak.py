"""The service under steady load: memory, threads, file descriptors and the event loop's delay do not rise.

Usage: python -m tests.campaigns.soak [--minutes 30] [--vehicles 50] [--sockets 100] [--seed N]

The vehicles are simulated, several on each port (one process takes at most 15 links), and deliver again and again.
Faults strike them at random: loss, delay, cut links, reboots. Sockets follow the stream; one of them after the other
leaves and comes back with after=. Clients read every list and store plans.

The service is measured once a second. After a warm-up (a fifth of the time, at least 20 s), the rest is cut into 12
equal blocks; the slope is that of the line through their means, and its 95 % interval is Student's with 10 degrees
of freedom. A measure has risen if the lower end of that interval, times the time, is more than what is allowed: what
is printed last. Exit status 1 if one has risen, or the service failed.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Coroutine
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import aiohttp

from app.services.access import Access, Role
from app.services.clock import SystemClock
from app.storage.storage import open_storage
from tests.campaigns.slopes import BLOCKS, slope_of
from tests.support.paths import PLANS
from tests.support.plan_pieces import RETURN, gripper, plan_json, takeoff, waypoint
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet, free_udp_ports

ON_A_PORT: Final = 10
SAMPLE_S: Final = 1.0
LEAST_WARM_UP_S: Final = 20.0
ALLOWED: Final = {"memory, MiB": 4.0, "threads": 1.0, "file descriptors": 4.0, "loop delay, ms": 5.0}
"""Rise over the time measured that counts as none: caches that are still filling, a file that is open at the moment."""
CLIENTS: Final = 4
PACE_S: Final = 0.25
FAULT_EVERY_S: Final = 1.0
FAULT_S: Final = 5.0
SOCKET_LIFE_S: Final = 1.0
"""Every so often one of the sockets is exchanged for a new one."""
FOUND_S: Final = 180.0
TOKENS: Final = 4
"""Principals that share the sockets: one may have 64."""
PATHS: Final = ("vehicles", "runs", "plans", "jobs", "job-queues", "events?limit=50", "webhooks", "audit?limit=20")
DELIVERY: Final = plan_json(
    "multicopter", takeoff(12), waypoint(30, 0, 12, hold_s=2), gripper(mode="embedded"), RETURN, name="soak"
)
BIG_PLAN: Final = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
DELAY_SUM: Final = re.compile(r"^waydrop_loop_delay_seconds_(sum|count) (\S+)$", re.MULTILINE)


@dataclass
class Found:
    """What was measured and done."""

    samples: dict[str, list[tuple[float, float]]] = field(default_factory=lambda: {name: [] for name in ALLOWED})
    done: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def fell(self, how: str) -> None:
        if len(self.failures) < 50 and how not in self.failures:
            self.failures.append(how)


@dataclass
class Soak:
    """The service, its vehicles, and who uses it."""

    service: ServiceProcess
    fleets: list[SimulatedFleet]
    http: aiohttp.ClientSession
    tokens: list[str]
    chance: random.Random
    found: Found

    def whose(self, number: int) -> dict[str, str]:
        return {"Authorization": f"Bearer {self.tokens[number % len(self.tokens)]}"}

    async def read(self, number: int) -> None:
        """A client that reads everything and stores plans, without an end."""
        while True:
            for path in PATHS:
                await self.call("GET", path, number)
            await self.call("POST", "plans", number, {**BIG_PLAN, "name": f"soak {time.time()}"})

    async def call(self, method: str, path: str, number: int, body: Any = None) -> Any:
        """One request in its pace; the answer, None if it was refused."""
        await asyncio.sleep(PACE_S)
        url, headers = f"{self.service.url}/api/v1/{path}", self.whose(number)
        async with self.http.request(method, url, headers=headers, json=body) as answer:
            self.found.done[f"{answer.status // 100}xx"] += 1
            if answer.status in (500, 401, 403) or (answer.status >= 500 and method == "GET"):
                self.found.fell(f"{method} {path}: {answer.status} {(await answer.text())[:200]}")
            return await answer.json() if answer.ok else await answer.read() and None

    async def deliver(self, vehicles: int) -> None:
        """Let every vehicle that has no run deliver, without an end."""
        plan = await self.call("POST", "plans", 0, DELIVERY)
        while True:
            listed = await self.call("GET", "runs?open=true&limit=500", 0)
            busy = {run["vehicle_id"] for run in (listed or {"runs": []})["runs"]}
            for number in range(1, vehicles + 1):
                if f"v{number}" not in busy:
                    order = {"plan": plan["id"], "vehicle": f"v{number}", "start": True}
                    if await self.call("POST", "runs", 0, order) is not None:
                        self.found.done["runs"] += 1

    async def follow(self, number: int, until: asyncio.Event) -> None:
        """One socket; when `until` is set it leaves, and comes back for what it has missed."""
        after = ""
        while True:
            url = f"{self.service.url}/api/v1/stream{after}"
            async with self.http.ws_connect(url, headers=self.whose(number)) as socket:
                self.found.done["sockets"] += 1
                while not until.is_set():
                    message = await socket.receive()
                    if message.type is not aiohttp.WSMsgType.TEXT:
                        self.found.done[f"socket closed by {socket.close_code}"] += 1
                        break
                    self.found.done["frames"] += 1
                    if message.data.startswith('{"type":"event"'):
                        after = f"?after={json.loads(message.data)['event']['seq']}"
            until.clear()

    async def exchange(self, leave: list[asyncio.Event]) -> None:
        """One socket after the other leaves."""
        while True:
            await asyncio.sleep(SOCKET_LIFE_S)
            self.chance.choice(leave).set()

    async def strike(self) -> None:
        """One fault after the other, each for a while."""
        lasting = {"loss": (0.2, 0.0), "delay_s": (0.3, 0.0), "jitter_s": (0.2, 0.0), "link_cut": (True, False)}
        ends = list[asyncio.Task[None]]()
        while True:
            await asyncio.sleep(FAULT_EVERY_S)
            number = self.chance.randrange(len(self.fleets))
            system_id = number * ON_A_PORT + self.chance.randint(1, ON_A_PORT)
            fault = self.chance.choice([*lasting, "reboot"])
            value, end = lasting.get(fault, (True, None))
            await self._set(number, fault, value, system_id)
            if end is not None:
                ends = [task for task in ends if not task.done()]
                ends.append(asyncio.create_task(self._end(number, fault, end, system_id), name=f"end of {fault}"))

    async def _end(self, number: int, fault: str, value: Any, system_id: int) -> None:
        await asyncio.sleep(FAULT_S)
        await self._set(number, fault, value, system_id)

    async def _set(self, number: int, fault: str, value: Any, system_id: int) -> None:
        try:
            await asyncio.to_thread(self.fleets[number].control, fault, value, system_id=system_id)
            self.found.done["faults"] += 1
        except AssertionError:
            self.found.done["faults refused"] += 1  # the last port may have fewer vehicles

    async def measure(self) -> None:
        """Sample after sample, without an end."""
        process, began_s, before = Path(f"/proc/{self.service.pid}"), time.monotonic(), (0.0, 0.0)
        while True:
            await asyncio.sleep(SAMPLE_S)
            at_s = time.monotonic() - began_s
            status = dict(
                line.split(":\t", 1) for line in (process / "status").read_text().splitlines() if ":\t" in line
            )
            metrics = await (await self.http.get(f"{self.service.url}/metrics", headers=self.whose(0))).text()
            told = {name: float(value) for name, value in DELAY_SUM.findall(metrics)}
            now = told["sum"], told["count"]
            delay_ms = (now[0] - before[0]) / max(1.0, now[1] - before[1]) * 1e3
            before = now
            seen = (
                float(status["VmRSS"].split()[0]) / 1024.0,
                float(status["Threads"]),
                float(len(list((process / "fd").iterdir()))),
                delay_ms,
            )
            for name, value in zip(ALLOWED, seen, strict=True):
                self.found.samples[name].append((at_s, value))


async def soak(given: argparse.Namespace, folder: Path, found: Found) -> None:
    """All of it, for so long."""
    counts = [min(ON_A_PORT, given.vehicles - first) for first in range(0, given.vehicles, ON_A_PORT)]
    port = free_udp_ports(len(counts))
    with ExitStack() as stack:
        fleets = [
            stack.enter_context(
                SimulatedFleet(
                    ",".join(f"quad:sysid={number * ON_A_PORT + index}" for index in range(1, count + 1)),
                    shared_port=True,
                    port=port + number,
                    params="COM_DISARM_PRFLT=20.0",
                )
            )
            for number, count in enumerate(counts)
        ]
        tokens = await new_tokens(folder)
        service = stack.enter_context(ServiceProcess(folder, [fleet.connections[0] for fleet in fleets]))
        async with aiohttp.ClientSession(
            connector=aiohttp.TCPConnector(limit=0), timeout=aiohttp.ClientTimeout(total=60)
        ) as http:
            this = Soak(service, fleets, http, tokens, random.Random(given.seed), found)
            http.headers.update(this.whose(0))
            await Dispatcher(http, service.url).until_vehicles(given.vehicles, FOUND_S)
            print(f"{given.vehicles} vehicles on {len(fleets)} ports are found", flush=True)
            await use(this, given)
        log = service.log_path.read_text(errors="replace")
    for line in log.splitlines():
        if "Traceback" in line or "defect" in line:
            found.fell(f"logged: {line[:300]}")


async def use(this: Soak, given: argparse.Namespace) -> None:
    """Everybody at once, until the time is up."""
    leave = [asyncio.Event() for _ in range(given.sockets)]
    work: list[Coroutine[Any, Any, None]] = [
        *(this.read(number) for number in range(CLIENTS)),
        *(this.follow(number, event) for number, event in enumerate(leave)),
        this.exchange(leave),
        this.deliver(given.vehicles),
        this.strike(),
        this.measure(),
    ]
    tasks = [asyncio.create_task(one) for one in work]
    done, _ = await asyncio.wait(tasks, timeout=given.minutes * 60.0, return_when=asyncio.FIRST_COMPLETED)
    print(f"measured for {given.minutes:g} minutes", flush=True)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    for task in done:
        this.found.fell(f"it ended early: {task.exception()!r}")


async def new_tokens(folder: Path) -> list[str]:
    """Tokens of administrators, in the data folder of a service that does not run yet."""
    async with open_storage(folder / "waydrop.db") as storage:
        access = Access(storage.tokens, SystemClock(), None)
        return [(await access.create_token(f"soak {number}", Role.ADMIN))[1] for number in range(TOKENS)]


def judge(found: Found, minutes: float) -> None:
    """Print the slopes; note what has risen."""
    warm_up_s = max(LEAST_WARM_UP_S, minutes * 12.0)
    print(f"after a warm-up of {warm_up_s:.0f} s:")
    for name, samples in found.samples.items():
        steady = [sample for sample in samples if sample[0] >= warm_up_s]
        if len(steady) < BLOCKS:
            found.fell(f"{name} was measured {len(steady)} times only: the service hardly answers")
            continue
        slope = slope_of(steady)
        risen = slope.least_rise > ALLOWED[name]
        rise = f"a sure rise of {max(0.0, slope.least_rise):.2f}, allowed {ALLOWED[name]:g}"
        line = f"{slope.first:9.2f} to {slope.last:9.2f}, slope {slope.per_hour:+9.2f} +- {slope.margin:.2f} an hour"
        print(f"{name:18} {line}, {rise}{': RISEN' if risen else ''}")
        if risen:
            found.fell(f"{name} rises")


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="the service under steady load")
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--vehicles", type=int, default=50)
    parser.add_argument("--sockets", type=int, default=100)
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    found = Found()
    with tempfile.TemporaryDirectory(prefix="waydrop-soak-") as folder:
        asyncio.run(soak(given, Path(folder) / "data", found))
    print(", ".join(f"{what}: {count}" for what, count in sorted(found.done.items())))
    judge(found, given.minutes)
    print("\n".join(found.failures))
    print(f"{given.minutes:g} minutes: {len(found.failures)} failures")
    sys.exit(bool(found.failures))


if __name__ == "__main__":
    main()
