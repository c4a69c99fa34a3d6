"""Requests made from the OpenAPI document, and frames: no answer is a 5xx, and every answer is as documented.

Usage: python -m tests.campaigns.fuzz [--requests 100000] [--seconds 0] [--seed N]

Schemathesis makes the requests, good and bad ones, of every operation in turn; most get the ids of plans, runs,
vehicles, jobs, tasks, leases and webhooks that exist. Each is sent as several of nobody, a viewer, a dispatcher, a
pilot and an admin, while the scripted vehicles fly, land, refuse and lose their links. Some are followed by frames over
a websocket, from the AsyncAPI document. A 5xx is right only where a vehicle has refused or was silent. Status, media
type, body and problem code are held to the document, and so are the frames that come back. Exit status 1 if anything
fell.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import random
import sys
import tempfile
import time
import warnings
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import aiohttp
import schemathesis
import structlog
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import HypothesisException, Unsatisfiable
from schemathesis import GenerationMode
from schemathesis.core.errors import SchemathesisError

from app.services.access import Role
from tests.campaigns.frames import assert_told, frames_of
from tests.campaigns.known_ids import NOWHERE, KnownIds
from tests.campaigns.lively_vehicles import live
from tests.support.described import DOCUMENT, assert_described
from tests.support.paths import PLANS
from tests.support.service_in_process import Service, run_service
from tests.support.uploads import JPEG

EXAMPLES: Final = 20
"""Requests of an operation before the next one has its turn."""
AT_ONCE: Final = 3
"""So often each is sent at the same time, as somebody else."""
FRAMES: Final = 5
QUIET: Final = 20
"""To each request that frames follow there are so many without."""
SOCKETS: Final = {
    "stream": "/api/v1/stream",
    "offboard": "/api/v1/vehicles/{vehicle_id}/offboard",
    "reports": "/api/v1/targets/ship/reports",
}
INTERNAL_ERROR: Final = 1011
ANSWERED_S: Final = 30.0
VEHICLES: Final = 6
STOCK_EVERY: Final = 200
"""Requests after which plans, runs, jobs, leases, tasks and webhooks are made anew."""
WEIGHTS: Final = {None: 1, Role.VIEWER: 3, Role.DISPATCHER: 5, Role.PILOT: 6, Role.ADMIN: 6}
"""How often a request is sent as whom. Nobody is soon answered with 429 alone."""
PLAN: Final[dict[str, Any]] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
DROPS: Final = tuple(item["id"] for item in PLAN["items"] if item["type"] == "gripper")
TASK: Final = {"type": "goto", "point": {"east_m": 10.0, "north_m": 20.0}}
SETPOINT: Final = {"type": "velocity_ned", "north_m_s": 2.0, "east_m_s": 0.0}
BODIES: Final[dict[str, Any]] = {
    "plans": PLAN,
    "plan-checks": {"plan": PLAN},
    "runs": {"plan": "", "vehicle": "", "start": True},
    "mission": {"plan": PLAN},
    "jobs": {"plan": "", "vehicle": "any", "min_battery_percent": 0},
    "tasks": {"lease": "", "task": TASK},
    "target": {"lease": "", "point": TASK["point"]},
    "setpoint": {"lease": "", "setpoint": SETPOINT},
    "enter": {"lease": ""},
    "leave": {"lease": "", "to": "hold"},
}
"""Right bodies: most requests have one of these, with one field as Schemathesis made it."""
OF_A_VEHICLE: Final = frozenset({"vehicle.link", "vehicle.timeout", "mission.upload_failed", "command.expired"})
"""What a vehicle that refuses or is silent is answered with: the only 5xx that are right."""
MANY_HOOKS: Final = 8


@dataclass
class Found:
    """What was sent, and what fell."""

    requests: int = 0
    frames: int = 0
    told: int = 0
    """Frames of the service."""
    statuses: Counter[int] = field(default_factory=Counter)
    answered: defaultdict[str, bool] = field(default_factory=lambda: defaultdict(bool))
    """Whether an operation succeeded at least once."""
    failures: dict[str, str] = field(default_factory=dict)
    """The first of each kind."""
    without_faults: set[str] = field(default_factory=set)
    """Operations that have no wrong request."""

    def fell(self, what: str, how: str) -> None:
        self.failures.setdefault(what, how[:1500])


@dataclass
class Attack:
    """A running service, the tokens of each role, and what exists."""

    service: Service
    loop: asyncio.AbstractEventLoop
    headers: dict[Role | None, dict[str, str]]
    known: KnownIds
    chance: random.Random
    found: Found

    def whom(self) -> dict[str, str]:
        """The headers of somebody."""
        (role,) = self.chance.choices(list(WEIGHTS), list(WEIGHTS.values()))
        return self.headers[role]

    def send(self, case: Any) -> None:
        """One request, sent as several at once, in the service's loop; called from the thread that makes requests."""
        self.known.aim(case)
        asyncio.run_coroutine_threadsafe(self._send_as_some(case), self.loop).result(120)

    def say(self, channel: str, said: list[Any]) -> None:
        """Frames over one socket."""
        vehicle = self.known.any_of("vehicle_id") or "v0"
        path = SOCKETS[channel].format(vehicle_id=vehicle)
        frames = [
            frame if isinstance(frame, str | bytes) else json.dumps(self.known.aimed(frame, vehicle)) for frame in said
        ]
        asyncio.run_coroutine_threadsafe(self._say(channel, path, frames, self.whom()), self.loop).result(120)

    def stock(self) -> None:
        """Make what the next requests are aimed at."""
        asyncio.run_coroutine_threadsafe(self._stock(), self.loop).result(120)

    async def _send_as_some(self, case: Any) -> None:
        await asyncio.gather(*(self._send(case, self.whom()) for _ in range(AT_ONCE)))

    async def _send(self, case: Any, headers: dict[str, str]) -> None:
        request = case.as_transport_kwargs(base_url=self.service.url)
        sent = {part: request[part] for part in ("params", "data", "json", "cookies") if request.get(part) is not None}
        what = f"{case.method} {case.path}"
        try:
            async with self.service.http.request(
                case.method,
                request["url"],
                headers={**dict(request.get("headers") or {}), **headers},
                allow_redirects=False,
                timeout=aiohttp.ClientTimeout(total=60),
                **sent,
            ) as answer:
                raw = await answer.read()
        except (ValueError, TypeError, UnicodeError, aiohttp.InvalidURL):
            return  # the client itself cannot send this
        except (aiohttp.ClientError, TimeoutError) as error:
            self.found.fell(f"{what}: no answer", f"{error!r} to {request}")
            return
        self.found.requests += 1
        self.found.statuses[answer.status] += 1
        self.found.answered[what] |= answer.ok
        self._judge(what, case.method, answer, raw, str(request))

    def _judge(self, what: str, method: str, answer: aiohttp.ClientResponse, raw: bytes, request: str) -> None:
        try:
            body: Any = json.loads(raw) if answer.content_type.endswith("json") else raw.decode("utf-8", "replace")
            assert_described(method, answer.url.raw_path, answer.status, answer.content_type, body)
            if answer.status >= 500:
                assert body["code"] in OF_A_VEHICLE, f"{body['code']} is no vehicle's answer"
            if answer.ok and method == "POST":
                self.known.learn(answer.url.path, body)
        except (AssertionError, ValueError) as error:
            self.found.fell(f"{what}: not as documented, {answer.status}", f"{error}: {raw[:500]!r} to {request}")

    async def _say(self, channel: str, path: str, said: list[str | bytes], headers: dict[str, str]) -> None:
        url, what = self.service.url + path, f"frames of {channel}"
        try:
            async with self.service.http.ws_connect(url, headers=headers, autoping=False) as socket:
                if channel == "offboard":
                    await socket.send_json({"type": "acquire_lease"})
                for frame in said:
                    await (socket.send_bytes(frame) if isinstance(frame, bytes) else socket.send_str(frame))
                    self.found.frames += 1
                await socket.ping()
                await self._listen(channel, socket)
        except aiohttp.WSServerHandshakeError as error:
            if error.status >= 500:
                self.found.fell(f"handshake of {path}: {error.status}", str(error))
            return
        except (aiohttp.ClientError, ConnectionError, UnicodeError):
            return  # it closed, as it may
        except (AssertionError, TimeoutError) as error:
            self.found.fell(f"{what}: not as documented", f"{error!r} to {said!r}")
        if socket.close_code == INTERNAL_ERROR:
            self.found.fell(f"{what}: closed with {INTERNAL_ERROR}", repr(said))

    async def _listen(self, channel: str, socket: aiohttp.ClientWebSocketResponse) -> None:
        """Hold what comes to the document, until everything that was said is read."""
        while (told := await socket.receive(ANSWERED_S)).type is aiohttp.WSMsgType.TEXT:
            self.found.told += 1
            assert_told(channel, told.data)

    async def _stock(self) -> None:
        """As an admin and as a pilot; what is refused now is made another time."""
        admin, pilot = self.headers[Role.ADMIN], self.headers[Role.PILOT]
        vehicle = f"v{self.chance.randint(1, VEHICLES)}"
        await self._make("/plans", PLAN, admin)
        wanted = {"plan": self.known.any_of("plan_id") or "none", "vehicle": vehicle}
        run = await self._make("/runs", {**wanted, "start": self.chance.random() < 0.7}, admin)
        await self._make("/jobs", {**wanted, "min_battery_percent": 0}, admin)
        hooks = (await self.service.call("GET", "/api/v1/webhooks", headers=admin))[2]["webhooks"]
        if len(hooks) < MANY_HOOKS:
            await self._make("/webhooks", {"url": NOWHERE}, admin)
        offboard = f"/vehicles/{vehicle}"
        lease = await self._make(f"{offboard}/offboard/lease", {}, pilot)
        if lease is not None:
            await self._make(f"{offboard}/tasks", {"lease": lease["lease"], "task": TASK}, pilot)
        if run is not None:
            path = f"/runs/{run['id']}/drops/{DROPS[0]}/attachments"
            await self._make(f"{path}?name=door", JPEG, {**admin, "Content-Type": "image/jpeg"})

    async def _make(self, path: str, body: Any, headers: dict[str, str]) -> Any:
        sent: dict[str, Any] = {"data": body} if isinstance(body, bytes) else {"json": body}
        try:
            status, _, made = await self.service.call("POST", f"/api/v1{path}", headers=headers, **sent)
        except AssertionError as error:
            self.found.fell(f"POST {path}: not as documented", str(error))
            return None
        if status >= 300:
            return None
        self.known.learn(path.partition("?")[0], made)
        return made


def operations() -> list[Any]:
    """Every operation of the document that is a request."""
    schema = schemathesis.openapi.from_dict(DOCUMENT)
    return [result.ok() for result in schema.get_all_operations()]


def _said(channel: str | None) -> st.SearchStrategy[Any]:
    if channel is None:
        return st.none()
    return st.tuples(st.just(channel), st.lists(frames_of(channel), min_size=1, max_size=FRAMES))


said_after = st.sampled_from([*[None] * QUIET * len(SOCKETS), *SOCKETS]).flatmap(_said)
"""A channel and its frames, or nothing."""


def attack(target: Attack, requests: int, seconds: float, number: int) -> None:
    """Send until there are enough; runs in a thread of its own."""
    began_s, chance, turn, stocked = time.monotonic(), target.chance, 0, 0
    every = operations()
    found = target.found
    target.stock()

    def is_over() -> bool:
        return found.requests >= requests or bool(seconds and time.monotonic() - began_s >= seconds)

    while not is_over():
        chance.shuffle(every)
        for operation in every:
            if is_over():
                return
            turn += 1
            if found.requests >= stocked + STOCK_EVERY:
                target.stock()
                stocked = found.requests
            _burst(target, operation, number + turn, chance)


def _burst(
    target: Attack, operation: Any, number: int, chance: random.Random, mode: GenerationMode | None = None
) -> None:
    mode = mode or chance.choice([GenerationMode.POSITIVE, GenerationMode.NEGATIVE])

    @seed(number)
    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(case=operation.as_strategy(generation_mode=mode), said=said_after)
    def burst(case: Any, said: tuple[str, list[Any]] | None) -> None:
        target.send(case)
        if said is not None:
            target.say(*said)

    try:
        burst()
    except (HypothesisException, SchemathesisError) as error:
        if not (isinstance(error, Unsatisfiable) and mode is GenerationMode.NEGATIVE):
            target.found.fell(f"{operation.method} {operation.path}: {mode} requests cannot be made", repr(error))
            return
        # it takes no parameter and no body, so nothing of it can be wrong
        target.found.without_faults.add(f"{operation.method} {operation.path}")
        _burst(target, operation, number, chance, GenerationMode.POSITIVE)


async def campaign(folder: Path, requests: int, seconds: float, number: int) -> Found:
    """A service in this process with scripted vehicles, and the thread that attacks it."""
    found, chance = Found(), random.Random(number)
    async with run_service(folder, links=VEHICLES) as service:
        headers = {None: {}, **{role: await service.token(role) for role in Role}}
        vehicles = tuple(f"v{number}" for number in range(1, VEHICLES + 1))
        known = KnownIds(chance, BODIES, vehicle_id=vehicles, item_id=DROPS, feed=("ship",))
        target = Attack(service, asyncio.get_running_loop(), headers, known, chance, found)
        life = asyncio.create_task(live(service.links, random.Random(number)), name="vehicles")
        try:
            await asyncio.to_thread(attack, target, requests, seconds, number)
        finally:
            life.cancel()
            await asyncio.gather(life, return_exceptions=True)
        status, _, _ = await service.call("GET", "/healthz")
        if status != 200:
            found.fell("the service at the end", f"/healthz is {status}")
    return found


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="requests and frames that nobody expects")
    parser.add_argument("--requests", type=int, default=100_000)
    parser.add_argument("--seconds", type=float, default=0.0, help="end after so long even with fewer requests")
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given_ = parser.parse_args()
    warnings.simplefilter("ignore")
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.CRITICAL))
    print(f"seed {given_.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="waydrop-fuzz-") as folder:
        found = asyncio.run(campaign(Path(folder), given_.requests, given_.seconds, given_.seed))
    for what, how in found.failures.items():
        print(f"{what}\n    {how}")
    statuses = ", ".join(f"{status}: {count}" for status, count in sorted(found.statuses.items()))
    if found.without_faults:
        print(f"without parameters or body, so only sent as they are: {', '.join(sorted(found.without_faults))}")
    never = sorted(what for what, succeeded in found.answered.items() if not succeeded)
    print(f"never answered with success: {', '.join(never) or 'none'}")
    print(
        f"{found.requests} requests ({statuses}), {found.frames} frames, {found.told} frames back: "
        f"{len(found.failures)} failures"
    )
    sys.exit(bool(found.failures or found.requests == 0))


if __name__ == "__main__":
    main()
