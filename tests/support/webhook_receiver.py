"""A system that webhooks are sent to: it takes messages, checks their signatures, and misbehaves as it is told."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import hmac
import json
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from aiohttp import web

from tests.support.patience import Patience


@dataclass(frozen=True)
class Received:
    """One request as it came."""

    headers: dict[str, str]
    body: bytes

    @property
    def message(self) -> Any:
        """The body as JSON."""
        return json.loads(self.body)

    @property
    def id(self) -> str:
        return str(self.message["id"])

    @property
    def type(self) -> str:
        return str(self.message["type"])

    def is_signed_with(self, secret: str) -> bool:
        """Whether the signature fits, as a receiver computes it."""
        id_, timestamp = self.headers["webhook-id"], self.headers["webhook-timestamp"]
        key = base64.b64decode(secret.removeprefix("whsec_"))
        signed = hmac.new(key, f"{id_}.{timestamp}.".encode() + self.body, hashlib.sha256)
        given = base64.b64decode(self.headers["webhook-signature"].removeprefix("v1,"))
        return id_ == self.id and hmac.compare_digest(signed.digest(), given)


@dataclass
class Receiver:
    """`plan` is how the next requests are answered, then `usual`: a status, or "hang", "reset", "slow", "endless",
    "redirect". `taken` are those answered with 2xx, `requests` all.
    """

    usual: int | str = 200
    plan: deque[int | str] = field(default_factory=deque)
    requests: list[Received] = field(default_factory=list)
    taken: list[Received] = field(default_factory=list)
    most_at_once: int = 0
    retry_after: str | None = None
    url: str = ""
    _now: int = 0
    _released: asyncio.Event = field(default_factory=asyncio.Event)

    @asynccontextmanager
    async def serving(self, port: int = 0) -> AsyncIterator[Receiver]:
        """Answer on a port while the block runs."""
        app = web.Application()
        app.router.add_post("/hook", self._answer)
        app.router.add_post("/elsewhere", self._elsewhere)
        runner = web.AppRunner(app, shutdown_timeout=0.1)
        await runner.setup()
        site = web.TCPSite(runner, "127.0.0.1", port)
        await site.start()
        self.url = f"http://127.0.0.1:{runner.addresses[0][1]}/hook"
        try:
            yield self
        finally:
            self._released.set()
            await runner.cleanup()

    async def until(self, condition: Callable[[], bool], *, within_s: float = 30.0) -> None:
        """Wait until something is so."""
        patience = Patience(within_s)
        while not condition():
            assert not patience.is_over(), f"it must be so within {within_s:g} s; {self.types()} were taken"
            await asyncio.sleep(0.01)

    def types(self) -> list[str]:
        """The types of all that was taken, in order."""
        return [received.type for received in self.taken]

    def once(self) -> list[str]:
        """The types in order, repetitions left out by their id, as every receiver should."""
        return [received.type for received in {one.id: one for one in self.taken}.values()]

    async def _answer(self, request: web.Request) -> web.StreamResponse:
        received = Received(dict(request.headers), await request.read())
        self.requests.append(received)
        self._now += 1
        self.most_at_once = max(self.most_at_once, self._now)
        try:
            return await self._behave(request, received, self.plan.popleft() if self.plan else self.usual)
        finally:
            self._now -= 1

    async def _behave(self, request: web.Request, received: Received, how: int | str) -> web.StreamResponse:
        if how == "hang":
            await self._released.wait()
        if how == "reset":
            assert request.transport is not None
            request.transport.abort()
            return web.Response()
        if how == "redirect":
            return web.Response(status=307, headers={"Location": "/elsewhere"})
        if how in ("slow", "endless"):
            return await self._trickle(request, received, endless=how == "endless")
        status = how if isinstance(how, int) else 200
        if 200 <= status < 300:
            self.taken.append(received)
        headers = {} if self.retry_after is None else {"Retry-After": self.retry_after}
        return web.Response(status=status, headers=headers)

    async def _trickle(self, request: web.Request, received: Received, *, endless: bool) -> web.StreamResponse:
        """A good status, then a body that comes a byte at a time, or never ends."""
        self.taken.append(received)
        response = web.StreamResponse()
        await response.prepare(request)
        try:
            while not self._released.is_set():
                await response.write(b"x" * (65536 if endless else 1))
                await asyncio.sleep(0 if endless else 0.05)
        except ConnectionError:
            return response
        return response

    async def _elsewhere(self, request: web.Request) -> web.Response:
        raise AssertionError("a redirect was followed")
