"""What goes on in a cluster while its parts fail: dispatchers that let vehicles deliver, writers, followed streams."""

from __future__ import annotations

import asyncio
import json
import random
import time
import uuid
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from typing import Any, Final

import aiohttp

from tests.support.cluster_process import Cluster
from tests.support.judged_flights import DELIVERIES, OVER, FlightJudge
from tests.support.simulated import SimulatedFleet
from tests.support.simulator_truth import Truth, watched_truth
from tests.support.stream_follower import StreamFollower

AGAIN: Final = frozenset(
    {"storage.failed", "cluster.bus_down", "gateway.unreachable", "cluster.site_undecided", "service.unavailable"}
)
"""Nothing was done: the same request may be sent again."""
UNKNOWN: Final = frozenset({"gateway.no_reply", "idempotency.outcome_unknown"})
"""It may have been done: a dispatcher looks before it does anything else."""
OF_VEHICLES: Final = frozenset({"command.expired", "vehicle.link", "vehicle.timeout", "mission.upload_failed"})
AGAIN_S: Final = 0.3
LOOK_EVERY_S: Final = 0.3
WRITE_EVERY_S: Final = 0.25
ANSWER_S: Final = 30.0
ASKED_FOR_S: Final = 60.0
"""How long a dispatcher repeats one request."""
UNKNOWN_S: Final = 5.0
"""The same for a request whose outcome is not known."""
WAITING_S: Final = 5.0
"""A run or job that waits for its start for so long is started by the dispatcher: a part failed in between."""
LAND_S: Final = 240.0
CHARGE_EVERY_S: Final = 10.0
JOB_OVER: Final = frozenset({"completed", "failed", "cancelled", "expired"})


@dataclass
class Found:
    """What was done, what was acknowledged, and what fell."""

    troubles: Counter[str] = field(default_factory=Counter)
    written: dict[str, str] = field(default_factory=dict)
    """The name of the plan of each plan, run and job that was answered with 2xx, by its path."""
    answers: Counter[str] = field(default_factory=Counter)
    outcomes: Counter[str] = field(default_factory=Counter)
    events: int = 0
    failures: list[str] = field(default_factory=list)

    def fell(self, how: str) -> None:
        if how not in self.failures:
            self.failures.append(how)


class ClusterDispatcher:
    """A dispatcher that asks any API node, and repeats what was not answered at another one, with the same key."""

    def __init__(self, http: aiohttp.ClientSession, cluster: Cluster, chance: random.Random, found: Found) -> None:
        self._http = http
        self.urls = [node.url for node in cluster.nodes]
        self._chance = chance
        self._found = found

    async def get(self, path: str) -> Any:
        """The answer of a node, None if this one does not answer."""
        try:
            async with self._http.get(f"{self._chance.choice(self.urls)}/api/v1{path}") as answer:
                return await self._read(answer) if answer.ok else None
        except (aiohttp.ClientError, ConnectionError, TimeoutError, json.JSONDecodeError):
            return None

    async def post(self, path: str, body: Any) -> tuple[str, Any]:
        """`done`, `refused` or `unknown`, and what was answered."""
        key, until_s, outcome = {"Idempotency-Key": uuid.uuid4().hex}, time.monotonic() + ASKED_FOR_S, "refused"
        urls = self.urls  # a key is known where it was used
        while time.monotonic() < until_s:
            try:
                async with self._http.post(
                    f"{self._chance.choice(urls)}/api/v1{path}", json=body, headers=key
                ) as answer:
                    told = await self._read(answer)
            except (aiohttp.ClientError, ConnectionError, TimeoutError, json.JSONDecodeError):
                self._found.answers["none"] += 1
                outcome = "unknown"
            else:
                code = str(answer.status) if answer.ok else f"{answer.status} {told['code']}"
                self._found.answers[code] += 1
                if answer.ok:
                    return "done", told
                if told["code"] in UNKNOWN:
                    outcome, until_s = "unknown", min(until_s, time.monotonic() + UNKNOWN_S)
                elif told["code"] not in AGAIN:
                    if answer.status >= 500 and told["code"] not in OF_VEHICLES:
                        self._found.fell(f"POST {path}: {answer.status} {told}")
                    return outcome, told
            await asyncio.sleep(AGAIN_S)
        return outcome, None

    async def _read(self, answer: aiohttp.ClientResponse) -> Any:
        return json.loads(await answer.text())


class SiteDeliveries:
    """One vehicle's: one after the other, as runs or as jobs."""

    def __init__(
        self, vehicle_id: str, truth: Truth, dispatcher: ClusterDispatcher, found: Found, chance: random.Random
    ) -> None:
        self._vehicle_id = vehicle_id
        self._truth = truth
        self._dispatcher = dispatcher
        self._found = found
        self._chance = chance
        self._judge = FlightJudge(vehicle_id, truth, found.failures)
        self.judge_moves = self._judge.judge_moves
        self.seen = ""
        self._judged: set[str] = set()
        self._job_id = ""
        self._waits: tuple[str, float] = ("", 0.0)

    async def fly(self, stopping: asyncio.Event) -> None:
        """Until it is told to stop, and the last one is over and landed."""
        while True:
            if await self._is_free():
                if stopping.is_set():
                    return
                await self._begin()
            await asyncio.sleep(LOOK_EVERY_S)

    async def _is_free(self) -> bool:
        """Whether nothing is under way; what waits for a dispatcher is started."""
        listed = await self._dispatcher.get(f"/runs?vehicle={self._vehicle_id}&limit=1")
        job = await self._dispatcher.get(f"/jobs/{self._job_id}") if self._job_id else None
        self.seen = f"{self._vehicle_id}: {listed}, {job}, {self._truth}"
        if listed is None or (self._job_id and job is None):
            return False
        run = next(iter(listed["runs"]), None)
        if run is not None and run["state"] not in OVER:
            if run["state"] == "uploaded" and self._waits_long(f"{run['id']} is uploaded"):
                await self._start(f"/runs/{run['id']}/start", {})
            return False
        if self._truth.armed:
            return False  # on its way home
        if run is not None and run["id"] not in self._judged:
            self._judged.add(run["id"])
            self._found.outcomes[self._judge.judge_drop(run)] += 1
        if job is not None and job["state"] == "queued" and self._waits_long(f"{job['id']} is queued"):
            await self._dispatcher.post(f"/job-queues/{self._vehicle_id}/resume", {})
        return job is None or job["state"] in JOB_OVER

    def _waits_long(self, what: str) -> bool:
        if self._waits[0] != what:
            self._waits = (what, time.monotonic())
        is_long = time.monotonic() - self._waits[1] > WAITING_S
        if is_long:
            self._waits = ("", 0.0)
        return is_long

    async def _begin(self) -> None:
        self.judge_moves()
        self._truth.forget()
        self._job_id, name = "", f"{self._vehicle_id} {uuid.uuid4().hex}"
        outcome, plan = await self._dispatcher.post(
            "/plans", {**DELIVERIES[self._chance.choice(list(DELIVERIES))], "name": name}
        )
        if outcome != "done":
            return
        self._found.written[f"/plans/{plan['id']}"] = name
        order = {"plan": plan["id"], "vehicle": self._vehicle_id}
        if self._chance.random() < 0.5:
            if (run := await self._start("/runs", {**order, "start": True})) is not None:
                self._found.written[f"/runs/{run['id']}"] = name
        elif (job := await self._start("/jobs", {**order, "auto_start": True})) is not None:
            self._job_id = job["id"]
            self._found.written[f"/jobs/{job['id']}"] = name

    async def _start(self, path: str, body: Any) -> Any:
        self._judge.asked += 1
        outcome, told = await self._dispatcher.post(path, body)
        if outcome == "refused":
            self._judge.asked -= 1
        return told if outcome == "done" else None


class SharedDeliveries:
    """Jobs that vehicles of several sites may fly, one after the other. These vehicles fly nothing else."""

    def __init__(
        self, truths: Mapping[str, Truth], dispatcher: ClusterDispatcher, found: Found, chance: random.Random
    ) -> None:
        self._truths = truths
        self._dispatcher = dispatcher
        self._found = found
        self._chance = chance
        self._judges = {name: FlightJudge(name, truth, found.failures) for name, truth in truths.items()}
        self._ordered = 0
        self._plan_id = ""
        self._since_s = 0.0
        self.seen = ""

    def judge_moves(self) -> None:
        """Whether each vehicle flew undisturbed, and all together flew no more often than jobs were ordered."""
        for judge in self._judges.values():
            judge.judge_moves()
        if (flights := sum(truth.flights for truth in self._truths.values())) > self._ordered:
            self._found.fell(f"unsafe move: {flights} flights of {self._ordered} jobs that any site may fly")

    async def fly(self, stopping: asyncio.Event) -> None:
        """Until it is told to stop, and the last job is over and all have landed."""
        while True:
            if await self._is_over():
                if stopping.is_set():
                    return
                await self._order()
            await asyncio.sleep(LOOK_EVERY_S)

    async def _is_over(self) -> bool:
        """Whether the job of the newest plan is over, if there is one; it is judged then."""
        listed = await self._dispatcher.get(f"/jobs?plan={self._plan_id}&limit=1") if self._plan_id else {"jobs": []}
        self.seen = f"jobs that any site may fly: {listed}, {self._truths}"
        if listed is None or any(truth.armed for truth in self._truths.values()):
            return False
        job = next(iter(listed["jobs"]), None)
        if job is None:  # none was made, unless its answer was lost
            return time.monotonic() - self._since_s > UNKNOWN_S or not self._plan_id
        if job["state"] not in JOB_OVER:
            await self._go_on(job)
            return False
        run = await self._dispatcher.get(f"/runs/{job['run_id']}") if job["run_id"] else None
        if run is None and job["run_id"]:
            return False
        if run is not None:
            self._found.outcomes[f"any site: {self._judges[run['vehicle_id']].judge_drop(run)}"] += 1
        return True

    async def _go_on(self, job: dict[str, Any]) -> None:
        """What waits for an operator: a queue stops when a run failed, and no start is requested twice."""
        if time.monotonic() - self._since_s > WAITING_S:
            self._since_s = time.monotonic()
            for vehicle_id in self._truths:
                await self._dispatcher.post(f"/job-queues/{vehicle_id}/resume", {})
            if job["state"] == "prepared":
                await self._dispatcher.post(f"/runs/{job['run_id']}/start", {})

    async def _order(self) -> None:
        self.judge_moves()
        for truth in self._truths.values():
            truth.forget()
        self._plan_id, self._since_s, name = "", time.monotonic(), f"any site {uuid.uuid4().hex}"
        outcome, plan = await self._dispatcher.post(
            "/plans", {**DELIVERIES[self._chance.choice(list(DELIVERIES))], "name": name}
        )
        if outcome != "done":
            return
        self._found.written[f"/plans/{plan['id']}"] = name
        self._plan_id, self._ordered = plan["id"], self._ordered + 1
        for judge in self._judges.values():
            judge.asked += 1
        order = {"plan": plan["id"], "vehicle": "any", "allowed_vehicles": sorted(self._truths), "auto_start": True}
        outcome, job = await self._dispatcher.post("/jobs", order)
        self._since_s = time.monotonic()
        if outcome == "done":
            self._found.written[f"/jobs/{job['id']}"] = name


async def write_plans(dispatcher: ClusterDispatcher, found: Found, stopping: asyncio.Event) -> None:
    """A dispatcher that stores plan after plan."""
    while not stopping.is_set():
        name = f"written {uuid.uuid4().hex}"
        outcome, plan = await dispatcher.post("/plans", {**DELIVERIES["supervised"], "name": name})
        if outcome == "done":
            found.written[f"/plans/{plan['id']}"] = name
        await asyncio.sleep(WRITE_EVERY_S)


@dataclass(frozen=True)
class Load:
    """What goes on. `told` is the hash at each position, as any client of a stream was told."""

    followers: tuple[StreamFollower, ...]
    told: dict[int, str]
    judge: Callable[[], None]
    stop: Callable[[], None]
    """Begin nothing new."""
    finish: Callable[[], Awaitable[None]]
    """The same, and wait until all have landed. Streams are followed on."""
    dispatchers: dict[str, ClusterDispatcher]
    """The dispatchers of each site."""

    @contextmanager
    def served_by(self, site: str, url: str) -> Iterator[None]:
        """Let the dispatchers of a site use its gateway itself."""
        dispatcher = self.dispatchers[site]
        before, dispatcher.urls = dispatcher.urls, [url]
        try:
            yield
        finally:
            dispatcher.urls = before


async def charge_landed(fleets: Mapping[str, SimulatedFleet], truths: Mapping[str, Truth]) -> None:
    """Charge the vehicles on the ground until cancelled: a flight takes 5 % of a battery, and jobs ask for 30 %."""
    while True:
        for name, truth in truths.items():
            if not truth.armed:
                site, _, number = name.partition("-v")
                await asyncio.to_thread(fleets[site].control, "battery_percent", 100, system_id=int(number))
        await asyncio.sleep(CHARGE_EVERY_S)


@asynccontextmanager
async def loaded(
    cluster: Cluster, http: aiohttp.ClientSession, chance: random.Random, found: Found
) -> AsyncIterator[Load]:
    """Deliver, write and follow while the block runs."""
    async with AsyncExitStack() as stack:
        truths: dict[str, Truth] = {}
        for site, fleet in cluster.fleets.items():
            watched = await stack.enter_async_context(watched_truth(fleet.control_port))
            truths |= {f"{site}-v{number}": truth for number, truth in watched.by_id.items()}
        dispatchers = {site: ClusterDispatcher(http, cluster, chance, found) for site in cluster.gateways}
        writer, told = ClusterDispatcher(http, cluster, chance, found), dict[int, str]()
        nodes = [node.url for node in cluster.nodes]
        followers = tuple(StreamFollower(http, urls, told, found.fell) for urls in ([nodes[0]], [nodes[1]], nodes))
        shared = {name: truth for name, truth in truths.items() if not name.endswith("-v1")}
        deliveries: list[SiteDeliveries | SharedDeliveries] = [
            SiteDeliveries(name, truth, dispatchers[name.partition("-")[0]], found, chance)
            for name, truth in truths.items()
            if name not in shared
        ]
        if shared:
            deliveries.append(SharedDeliveries(shared, ClusterDispatcher(http, cluster, chance, found), found, chance))
        stopping = asyncio.Event()
        following = [asyncio.create_task(one.run(), name="follower") for one in followers]
        following.append(asyncio.create_task(charge_landed(cluster.fleets, truths), name="charger"))
        working = [asyncio.create_task(one.fly(stopping), name="deliveries") for one in deliveries]
        working.append(asyncio.create_task(write_plans(writer, found, stopping), name="writer"))

        def judge() -> None:
            for one in deliveries:
                one.judge_moves()

        async def finish() -> None:
            stopping.set()
            done, late = await asyncio.wait(working, timeout=LAND_S)
            seen = [one.seen for task, one in zip(working, deliveries, strict=False) if task in late]
            assert not late, f"not over after {LAND_S:g} s: {seen}"
            await asyncio.gather(*done)
            judge()

        try:
            yield Load(followers, told, judge, stopping.set, finish, dispatchers)
        finally:
            for task in (*working, *following):
                task.cancel()
            await asyncio.gather(*working, *following, return_exceptions=True)
