"""A service for tests of the command line: it answers as told and streams what it is given, cutting where told."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from aiohttp import web

from app.domain.events import AnyPayload, Event, NewEvent
from app.domain.events.run import RunChanged
from app.domain.run.run import Run
from tests.support.events import item

CUT = "cut"
"""In a script: close the socket here."""


def event(seq: int, payload: AnyPayload | None = None, run_id: str = "r1") -> Event:
    """An event of run r1 on vehicle v1."""
    new = NewEvent.of(payload or item(seq), 1000.0 + seq, vehicle_id="v1", run_id=run_id)
    return new.numbered(seq, "gw", "")


def changed(seq: int, run: Run) -> Event:
    """The event of a changed run."""
    return event(seq, RunChanged(run), run.id)


Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


@asynccontextmanager
async def answering(handler: Handler) -> AsyncIterator[str]:
    """The address of a server that answers every request so."""
    app = web.Application()
    app.router.add_route("*", "/{path:.*}", handler)
    async with _served(app) as url:
        yield url


@asynccontextmanager
async def _served(app: web.Application) -> AsyncIterator[str]:
    runner = web.AppRunner(app, shutdown_timeout=0.1)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    host, port = runner.addresses[0][:2]
    try:
        yield f"http://{host}:{port}"
    finally:
        await runner.cleanup()


@dataclass
class ScriptedService:
    """`script` is what the stream plays: events, and CUT. `run` is what POST and GET of a run answer."""

    script: Sequence[Event | str] = ()
    first_seq: int = 0
    run: Run | None = None
    plan_problem: dict[str, Any] | None = None
    close_code: int | None = None
    afters: list[str | None] = field(default_factory=list)
    posted: list[tuple[str, Any, str | None]] = field(default_factory=list)
    url: str = ""

    @asynccontextmanager
    async def serving(self) -> AsyncIterator[ScriptedService]:
        """Answer on a free port while the block runs."""
        app = web.Application()
        app.add_routes(
            [
                web.get("/api/v1/stream", self._stream),
                web.get("/api/v1/runs/{id}", self._get_run),
                web.post("/api/v1/{what}", self._post),
            ]
        )
        async with _served(app) as self.url:
            yield self

    async def _stream(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse()
        await socket.prepare(request)
        after = request.query.get("after")
        self.afters.append(after)
        if self.close_code is not None:
            await socket.close(code=self.close_code)
            return socket
        await socket.send_json({"type": "hello", "gateway": "gw", "seq": self.first_seq, "server_time": 0.0})
        await socket.send_json({"type": "snapshot", "seq": self.first_seq, "vehicles": [], "runs": []})
        await socket.send_json({"type": "telemetry", "time": 0.0, "vehicles": {"v1": {}}})
        cuts = len(self.afters)
        for entry in self.script:
            if isinstance(entry, str):
                cuts -= 1
                if cuts == 0:
                    await socket.close()
                    return socket
            elif entry.seq > int(after or self.first_seq):
                await socket.send_str('{"type":"event","event":' + entry.model_dump_json() + "}")
        await socket.receive()
        return socket

    async def _get_run(self, request: web.Request) -> web.Response:
        return web.json_response(self._run_document())

    async def _post(self, request: web.Request) -> web.Response:
        document = await request.json()
        self.posted.append((request.match_info["what"], document, request.headers.get("Idempotency-Key")))
        if request.match_info["what"] == "plans":
            if self.plan_problem is not None:
                return web.json_response(
                    self.plan_problem, status=self.plan_problem["status"], content_type="application/problem+json"
                )
            return web.json_response({"id": "p1"}, status=201)
        return web.json_response(self._run_document(), status=202)

    def _run_document(self) -> Any:
        assert self.run is not None
        return self.run.model_dump(mode="json")
