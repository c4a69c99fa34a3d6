"""The machine under the service fails: its clock jumps, its disk is full, read-only or slow, while vehicles deliver.

Usage: python -m tests.campaigns.host [--rounds 10] [--seconds 0] [--only SCENE] [--seed N]

Each round runs the scenes at once, each with a service and two simulated vehicles of its own; one has an embedded
drop, one a supervised drop. The trouble begins at a random moment of the flights, and ends at a later one; clients
store plans all the time. What is promised:

- The vehicles fly on: by what the simulator says they change their modes as in a flight without trouble, are armed
  once, release at most once, and land.
- What cannot be stored is refused: a plan is answered with 201, or with 503 and the code `storage.failed`.
- What was acknowledged before, in and after the trouble is there, and the journal has no gap, no double and no
  alteration.
- The service recovers by itself: when the trouble is over, it stores again, is ready, and ends both runs; each drop's
  outcome is what happened, or unknown. If only the clock jumped or the disk was slow, both are delivered.

Exit status 1 if anything fell.
"""

from __future__ import annotations

import argparse
import asyncio
import functools
import json
import multiprocessing
import os
import random
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import aiohttp

from app.storage import verify_journal
from tests.support.entered import entered
from tests.support.forked_service import ForkedService, serve
from tests.support.paths import PLANS, ROOT
from tests.support.plan_pieces import RETURN, gripper, plan_json, takeoff, waypoint
from tests.support.service_process import Dispatcher, Running, ServiceProcess, until
from tests.support.simulated import SimulatedFleet, free_udp_ports
from tests.support.simulator_truth import Truth, watched_truth

SPEED: Final = 4.0
DISK_MIB: Final = 16
SLOW_S: Final = 1.5
"""What each commit takes on a slow disk."""
JUMP_S: Final = 90_000.0
BEGINS_S, LASTS_S = (0.0, 8.0), (3.0, 8.0)
RUN_S: Final = 180.0
AGAIN_S: Final = 60.0
OVER: Final = frozenset({"completed", "aborted", "failed", "lost"})
FLIGHT: Final = ("LOITER", "MISSION", "RTL")
MOUNT: Final = f'mount -t tmpfs -o size={DISK_MIB}m,mode=700 waydrop "$0" && exec "$@"'
NAMESPACE: Final = ("unshare", "--user", "--map-root-user", "--mount", "sh", "-c")
BIG: Final = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
DELIVERIES: Final = {
    1: plan_json("multicopter", takeoff(12), waypoint(40, 0, 12, hold_s=5), gripper(mode="embedded"), RETURN),
    2: plan_json("multicopter", takeoff(12), waypoint(40, 0, 12), gripper(hold_s=120), RETURN),
}
"""The hold is long: a release ends it, and a slow disk may delay that."""


class OnSmallDisk(ServiceProcess):
    """A service whose data are on a small file system of its own, which can be filled."""

    def fill(self) -> None:
        """Until nothing fits any more."""
        with self._ballast.open("wb", buffering=0) as ballast:
            try:
                while True:
                    ballast.write(bytes(4096))
            except OSError:
                return

    def empty(self) -> None:
        self._ballast.unlink()

    def copy_data(self, to: Path) -> Path:
        """The data folder as it is at one moment; the file system goes with the process."""
        os.kill(self.pid, signal.SIGSTOP)
        try:
            shutil.copytree(f"/proc/{self.pid}/root{self.data_dir}", to)
        finally:
            os.kill(self.pid, signal.SIGCONT)
        return to

    @property
    def _ballast(self) -> Path:
        return Path(f"/proc/{self.pid}/root{self.data_dir}/ballast")

    def _spawn(self, environment: Mapping[str, str]) -> Running:
        command = [*NAMESPACE, MOUNT, str(self.data_dir), sys.executable, "-m", "app", "serve"]
        with self.log_path.open("ab") as log:
            return subprocess.Popen(command, cwd=ROOT, env=environment, stdout=log, stderr=log)


def serve_shifted(environment: Mapping[str, str], log_path: Path, ahead_s: Any, slow_s: Any) -> None:
    """A service whose wall clock and disk are changed from outside; see ForkedService."""
    right_time = time.time
    time.time = lambda: right_time() + ahead_s.value

    class SlowConnection(sqlite3.Connection):
        """It holds its thread at each commit, as a slow fsync does."""

        def execute(self, sql: str, /, *parameters: Any) -> sqlite3.Cursor:
            if sql == "COMMIT":
                time.sleep(slow_s.value)
            return super().execute(sql, *parameters)

        def commit(self) -> None:
            if self.in_transaction:
                time.sleep(slow_s.value)
            super().commit()

    sqlite3.connect = functools.partial(sqlite3.connect, factory=SlowConnection)
    serve(environment, log_path)


class Shifted(ForkedService):
    """A service whose wall clock can be set, and whose disk can be made slow."""

    def __init__(self, data_dir: Path, connections: Any) -> None:
        super().__init__(data_dir, connections)
        context = multiprocessing.get_context("forkserver")
        self.ahead_s, self.slow_s = context.Value("d", 0.0, lock=False), context.Value("d", 0.0, lock=False)

    def target(self) -> tuple[Callable[..., None], tuple[Any, ...]]:
        return serve_shifted, (self.ahead_s, self.slow_s)

    def set_clock(self, ahead_s: float) -> None:
        self.ahead_s.value = ahead_s

    def set_disk(self, slow_s: float) -> None:
        self.slow_s.value = slow_s

    def refuse_writes(self) -> None:
        """Every write to a file fails from now on, as after the kernel has remounted a broken disk read-only.

        A real remount is refused while files are open.
        """
        _, most = resource.prlimit(self.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.pid, resource.RLIMIT_FSIZE, (0, most))

    def allow_writes(self) -> None:
        _, most = resource.prlimit(self.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.pid, resource.RLIMIT_FSIZE, (most, most))


@dataclass(frozen=True)
class Scene:
    """How the trouble begins and ends, and whether it must leave the deliveries as they are."""

    name: str
    service: type[ServiceProcess]
    begin: Callable[[Any], None]
    end: Callable[[Any], None]
    delivers: bool


SCENES: Final = (
    Scene("clock forward", Shifted, lambda one: one.set_clock(JUMP_S), lambda one: one.set_clock(0.0), delivers=True),
    Scene("clock back", Shifted, lambda one: one.set_clock(-JUMP_S), lambda one: one.set_clock(0.0), delivers=True),
    Scene("disk slow", Shifted, lambda one: one.set_disk(SLOW_S), lambda one: one.set_disk(0.0), delivers=True),
    Scene("disk full", OnSmallDisk, OnSmallDisk.fill, OnSmallDisk.empty, delivers=False),
    Scene("disk read-only", Shifted, Shifted.refuse_writes, Shifted.allow_writes, delivers=False),
)


@dataclass
class Found:
    """What was done, and what fell."""

    rounds: Counter[str] = field(default_factory=Counter)
    plans: Counter[str] = field(default_factory=Counter)
    outcomes: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


class Round:
    """One scene, once."""

    def __init__(
        self, scene: Scene, dispatcher: Dispatcher, http: aiohttp.ClientSession, url: str, found: Found
    ) -> None:
        self._scene = scene
        self._dispatcher = dispatcher
        self._http = http
        self._url = f"{url}/api/v1"
        self._found = found
        self._stored: list[str] = []
        self._troubled = False

    def fell(self, how: str) -> None:
        self._found.failures.append(f"{self._scene.name}: {how}")

    async def store(self) -> None:
        """Plan after plan, without an end."""
        while True:
            await asyncio.sleep(0.1)
            await self.store_one()

    async def store_one(self) -> int:
        async with self._http.post(f"{self._url}/plans", json={**BIG, "name": f"{time.monotonic()}"}) as answer:
            body = await answer.json()
        self._found.plans[f"{self._scene.name} {answer.status}"] += 1
        if answer.status == 201:
            self._stored.append(body["id"])
        elif (answer.status, body["code"]) != (503, "storage.failed") or not self._troubled:
            self.fell(f"POST /plans: {answer.status} {body}")
        return answer.status

    async def fly(self, service: Any, truths: Mapping[int, Truth], chance: random.Random) -> None:
        """From the start to the journal."""
        await self._dispatcher.until_vehicles(len(DELIVERIES), 90)
        runs = {number: await self._dispatcher.fly(plan, f"v{number}") for number, plan in DELIVERIES.items()}
        in_air = {number for number in runs if await self._flies(runs[number], truths[number])}
        writing = asyncio.create_task(self.store(), name="plans")
        try:
            await asyncio.sleep(chance.uniform(*BEGINS_S))
            self._troubled = True
            await asyncio.to_thread(self._scene.begin, service)
            await asyncio.sleep(chance.uniform(*LASTS_S))
            await asyncio.to_thread(self._scene.end, service)
            await self.recovered()
            for number in in_air:
                await self._end(number, runs[number], truths[number])
        finally:
            writing.cancel()
            (ended,) = await asyncio.gather(writing, return_exceptions=True)
        if not isinstance(ended, asyncio.CancelledError):
            self.fell(f"clients: {ended!r}")
        await self._read_again()

    async def _flies(self, run_id: str, truth: Truth) -> bool:
        """Wait until it is in the air; a start that failed before the trouble is counted and left alone."""
        run = await self._dispatcher.until_run(
            run_id, lambda run: truth.height_m > 2 or run["state"] in OVER, "it must fly or fail", RUN_S
        )
        if truth.height_m <= 2:
            self._found.outcomes[f"{self._scene.name}: not started, {run['state']}"] += 1
        return truth.height_m > 2

    async def recovered(self) -> None:
        """It stores again without a restart, and says that it is ready."""
        deadline_s = time.monotonic() + AGAIN_S
        while await self.store_one() != 201:
            if time.monotonic() > deadline_s:
                self.fell("it does not store again")
                return
            await asyncio.sleep(0.5)
        self._troubled = False
        async with self._http.get(f"{self._url.removesuffix('/api/v1')}/readyz") as answer:
            if answer.status != 200:
                self.fell(f"/readyz is {answer.status}: {await answer.text()}")

    async def _end(self, number: int, run_id: str, truth: Truth) -> None:
        run = await self._dispatcher.until_over(run_id, RUN_S)
        await until(lambda: _now(truth.armed), lambda armed: not armed, f"v{number} must land", RUN_S)
        run = await self._dispatcher.get(f"/runs/{run_id}")
        outcome, released = run["drops"][0]["outcome"], truth.releases > 0
        self._found.outcomes[f"{self._scene.name}: {run['state']} {outcome}"] += 1
        if outcome != "unknown" and (outcome == "released") != released:
            self.fell(f"told is {outcome}, {truth.releases} were released: {run['state']}, {run['drops'][0]}")
        if self._scene.delivers and (run["state"], outcome) != ("completed", "released"):
            self.fell(f"v{number} must deliver: {run['state']} {run['reason']}, {run['drops'][0]}")
        if truth.modes != [mode for mode in FLIGHT if mode in truth.modes] or truth.flights != 1:
            self.fell(f"unsafe move: v{number} was armed {truth.flights} times, with the modes {truth.modes}")
        if truth.releases > 1:
            self.fell(f"unsafe move: v{number} released {truth.releases} times")

    async def _read_again(self) -> None:
        for plan_id in self._stored:
            async with self._http.get(f"{self._url}/plans/{plan_id}") as answer:
                if answer.status != 200:
                    self.fell(f"acknowledged plan lost: {answer.status} {await answer.text()}")
        after = 0
        while events := (await self._dispatcher.get(f"/events?after={after}&limit=500"))["events"]:
            if [event["seq"] for event in events] != list(range(after + 1, after + 1 + len(events))):
                self.fell(f"the events after {after} have a gap or a double")
            after = events[-1]["seq"]


async def _now(value: bool) -> bool:
    return value


async def play(scene: Scene, folder: Path, port: int, chance: random.Random, found: Found) -> None:
    """One scene."""
    async with AsyncExitStack() as stack:
        fleet = await entered(stack, SimulatedFleet("quad,quad", speed=SPEED, port=port))
        service = await entered(stack, scene.service(folder, fleet.connections))
        async with aiohttp.ClientSession() as http, watched_truth(fleet.control_port) as truths:
            this = Round(scene, Dispatcher(http, service.url), http, service.url, found)
            try:
                await this.fly(service, truths.by_id, chance)
            except (AssertionError, TimeoutError, aiohttp.ClientError) as error:
                this.fell(f"{error!r}")
        data = folder
        if isinstance(service, OnSmallDisk):
            data = await asyncio.to_thread(service.copy_data, folder / "copy")
        altered = (await verify_journal(data / "waydrop.db")).alterations
        log = service.log_path.read_text(errors="replace")
    for line in [str(one) for one in altered] + [one for one in log.splitlines() if "Traceback" in one]:
        this.fell(f"the journal or the log: {line[:500]}")
    found.rounds[scene.name] += 1


def may_mount() -> bool:
    """Whether this machine lets a process mount a file system of its own."""
    with tempfile.TemporaryDirectory() as folder:
        return subprocess.run([*NAMESPACE, MOUNT, folder, "true"], check=False, capture_output=True).returncode == 0


async def campaign(folder: Path, given: argparse.Namespace) -> Found:
    """Round after round of all scenes at once."""
    found, began_s = Found(), time.monotonic()
    scenes = [one for one in SCENES if given.only in (None, one.name)]
    if not may_mount():
        print("this machine lets no process mount a file system: the disk is not filled")
        scenes = [one for one in scenes if one.service is not OnSmallDisk]
    for number in range(given.rounds):
        if number and given.seconds and time.monotonic() - began_s > given.seconds:
            break
        port = free_udp_ports(len(scenes) * len(DELIVERIES))
        played = (
            play(
                one,
                folder / f"{number}-{index}",
                port + index * len(DELIVERIES),
                random.Random(f"{given.seed} {number} {index}"),
                found,
            )
            for index, one in enumerate(scenes)
        )
        await asyncio.gather(*played)
    return found


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="clock jumps and bad disks under deliveries")
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=0.0, help="begin no round after so long")
    parser.add_argument("--only", choices=[scene.name for scene in SCENES])
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    os.umask(0o077)
    with tempfile.TemporaryDirectory(prefix="waydrop-host-") as folder:
        found = asyncio.run(campaign(Path(folder), given))
    print("\n".join(found.failures))
    print(f"plans: {', '.join(f'{how}: {count}' for how, count in sorted(found.plans.items()))}")
    print(f"drops: {', '.join(f'{how}: {count}' for how, count in sorted(found.outcomes.items()))}")
    print(f"rounds: {', '.join(f'{name}: {count}' for name, count in found.rounds.items())}")
    print(f"{sum(found.rounds.values())} scenes: {len(found.failures)} failures")
    sys.exit(bool(found.failures or not found.rounds))


if __name__ == "__main__":
    main()
