"""Requests made from the OpenAPI document, and frames: no answer is a 5xx, and every answer is as documented.

Usage: python -m tests.campaigns.fuzz [--requests 100000] [--seconds 0] [--seed N]

Schemathesis makes the requests, good and bad ones, of every operation in turn; each is sent as nobody, a viewer, a
dispatcher, a pilot or an admin. Every tenth is followed by frames that hypothesis makes, over each websocket. Status,
media type, body and problem code are held to the document. Exit status 1 if anything fell.
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
from collections import Counter
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
from tests.support.described import DOCUMENT, assert_described
from tests.support.service_in_process import Service, run_service

EXAMPLES: Final = 20
"""Requests of an operation before the next one has its turn."""
FRAMES: Final = 5
SOCKETS: Final = ("/api/v1/stream", "/api/v1/vehicles/v1/offboard")
NOT_SENT: Final = frozenset({"/api/v1/stream", "/api/v1/vehicles/{vehicle_id}/offboard"})
"""Paths that need a handshake: their frames are sent, their requests are not."""
INTERNAL_ERROR: Final = 1011

frames = st.one_of(
    st.binary(max_size=200),
    st.text(max_size=200),
    st.dictionaries(
        st.sampled_from(["type", "id", "vehicle", "velocity", "position", "lease", "after", "x"]),
        st.one_of(st.none(), st.integers(), st.floats(), st.text(max_size=12), st.lists(st.integers(), max_size=4)),
        max_size=6,
    ).map(json.dumps),
)


@dataclass
class Found:
    """What was sent, and what fell."""

    requests: int = 0
    frames: int = 0
    statuses: Counter[int] = field(default_factory=Counter)
    failures: dict[str, str] = field(default_factory=dict)
    """The first of each kind."""
    without_faults: set[str] = field(default_factory=set)
    """Operations that have no wrong request."""

    def fell(self, what: str, how: str) -> None:
        self.failures.setdefault(what, how[:1500])


@dataclass
class Attack:
    """A running service, and the tokens of each role."""

    service: Service
    loop: asyncio.AbstractEventLoop
    headers: list[dict[str, str]]
    found: Found

    def send(self, case: Any, headers: dict[str, str]) -> None:
        """One request, in the service's loop; called from the thread that makes requests."""
        asyncio.run_coroutine_threadsafe(self._send(case, headers), self.loop).result(120)

    def say(self, path: str, said: list[str | bytes], headers: dict[str, str]) -> None:
        """Frames over one socket."""
        asyncio.run_coroutine_threadsafe(self._say(path, said, headers), self.loop).result(120)

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
        self._judge(what, case.method, answer, raw, str(request))

    def _judge(self, what: str, method: str, answer: aiohttp.ClientResponse, raw: bytes, request: str) -> None:
        if answer.status >= 500:
            self.found.fell(f"{what}: {answer.status}", f"{raw[:500]!r} to {request}")
        try:
            body: Any = json.loads(raw) if answer.content_type.endswith("json") else raw.decode("utf-8", "replace")
            assert_described(method, answer.url.raw_path, answer.status, answer.content_type, body)
        except (AssertionError, ValueError) as error:
            self.found.fell(f"{what}: not as documented, {answer.status}", f"{error} to {request}")

    async def _say(self, path: str, said: list[str | bytes], headers: dict[str, str]) -> None:
        try:
            async with self.service.http.ws_connect(self.service.url + path, headers=headers) as socket:
                for frame in said:
                    await (socket.send_bytes(frame) if isinstance(frame, bytes) else socket.send_str(frame))
                    self.found.frames += 1
        except aiohttp.WSServerHandshakeError as error:
            if error.status >= 500:
                self.found.fell(f"handshake of {path}: {error.status}", str(error))
            return
        except (aiohttp.ClientError, ConnectionError, UnicodeError):
            return  # it closed, as it may
        if socket.close_code == INTERNAL_ERROR:
            self.found.fell(f"frames of {path}: closed with {INTERNAL_ERROR}", repr(said))


def operations() -> list[Any]:
    """Every operation of the document that is a request."""
    schema = schemathesis.openapi.from_dict(DOCUMENT)
    found = [result.ok() for result in schema.get_all_operations()]
    return [operation for operation in found if operation.path not in NOT_SENT]


def attack(target: Attack, requests: int, seconds: float, number: int) -> None:
    """Send until there are enough; runs in a thread of its own."""
    began_s, chance, turn = time.monotonic(), random.Random(number), 0
    every = operations()
    found = target.found

    def is_over() -> bool:
        return found.requests >= requests or bool(seconds and time.monotonic() - began_s >= seconds)

    while not is_over():
        chance.shuffle(every)
        for operation in every:
            if is_over():
                return
            turn += 1
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
    @given(case=operation.as_strategy(generation_mode=mode), said=st.lists(frames, max_size=FRAMES))
    def burst(case: Any, said: list[str | bytes]) -> None:
        target.send(case, chance.choice(target.headers))
        if said and chance.random() < 0.1:
            target.say(chance.choice(SOCKETS), said, chance.choice(target.headers))

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
    found = Found()
    async with run_service(folder) as service:
        headers = [{}, *[await service.token(role) for role in Role]]
        target = Attack(service, asyncio.get_running_loop(), headers, found)
        await asyncio.to_thread(attack, target, requests, seconds, number)
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
    print(f"{found.requests} requests ({statuses}), {found.frames} frames: {len(found.failures)} failures")
    sys.exit(bool(found.failures or found.requests == 0))


if __name__ == "__main__":
    main()
