"""Messages to 100 websockets; the floor is a bare aiohttp loop that serialises once and sends to one after the other.

The clients are a process of their own and the same for both. Waydrop's number has everything in it from
Journal.record (events kept in a list, so that no disk is measured) over numbering, serialising and the bounded queue of
each socket to its writer task. In the floor one slow client would stop it for all. Counted is the CPU time of this
process, with that of the kernel for it: other processes do not lengthen it.
"""

from __future__ import annotations

import asyncio
import itertools
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from aiohttp import web

from app.api import ApiServices, ApiSettings, build_app
from app.domain.errors import NotFoundError
from app.domain.events import Event, NewEvent
from app.domain.events.run import RunItem
from app.domain.ports.stores import JobRecord, StoredAnswer, StoredPlan
from app.domain.ports.vehicle_link import Unsubscribe, VehicleLink
from app.domain.run.run import Run
from app.domain.vehicle.link_security import Refused, Relayed
from app.services.access import Access
from app.services.attachments import Attachments
from app.services.audit import Audit
from app.services.clock import SystemClock
from app.services.delivery_reports import Comparisons, DeliveryReports
from app.services.fleet import Fleet
from app.services.jobs import Jobs
from app.services.journal import Journal
from app.services.loop_watch import LoopWatch
from app.services.offboard import Offboard
from app.services.plans import KnownPlans, Plans
from app.services.runs import Runs
from app.services.runs.rerouting import Rerouting
from app.services.simulation import Simulation
from app.services.targets import Targets
from app.services.tasks import Tasks
from app.services.vehicle_commands import VehicleCommands
from app.services.vehicle_links import VehicleLinks
from app.services.webhooks import Webhooks
from app.storage import open_storage
from app.webhooks import open_sender
from bench.fanout_clients import last_marker
from bench.row import Goal, Pair, Round, Row

CLIENTS: Final = 100
EVENTS: Final = 1000
EVENTS_ONE_BY_ONE: Final = 300
"""Of one round."""

Send = Callable[[Sequence[NewEvent]], Awaitable[object]]


class ListStore:
    """EventStore in a list."""

    def __init__(self) -> None:
        self.events: list[Event] = []

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """See EventStore."""
        stored = numbered(events, len(self.events) + 1)
        self.events += stored
        return stored

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """See EventStore."""
        return self.events[after : after + limit]

    async def last_pruned(self) -> None:
        """See EventStore."""

    async def last_seq(self) -> int:
        """See EventStore."""
        return len(self.events)

    async def newest_accepted(self, *, before: int | None, limit: int) -> Sequence[Event]:
        """See EventStore."""
        return ()

    async def last_offboard(self) -> Sequence[Event]:
        """See EventStore. No vehicle is in offboard control here."""
        return ()


class NoVehicles:
    """LinkSource without any."""

    def links(self) -> Sequence[VehicleLink]:
        """See LinkSource."""
        return ()

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        """See LinkSource."""
        return lambda: None

    async def start(self) -> None:
        """See LinkSource."""

    async def close(self) -> None:
        """See LinkSource."""


class NoGuards:
    """LinkGuards of no connection."""

    def refused(self) -> Sequence[Refused]:
        """See LinkGuards."""
        return ()

    def relayed(self) -> Sequence[Relayed]:
        """See LinkGuards."""
        return ()

    async def set_up_signing(self, system_id: int, connection: str) -> str:
        """See LinkGuards."""
        raise NotFoundError(f"system {system_id} is not heard")


@dataclass(frozen=True, slots=True)
class Served:
    """A server with its clients: `send` gives events to all of them."""

    send: Send
    clients: asyncio.subprocess.Process


def numbered(events: Sequence[NewEvent], first: int) -> list[Event]:
    """Events as a journal numbers them."""
    return [event.numbered(seq, "gw-1", "") for seq, event in enumerate(events, first)]


@asynccontextmanager
async def waydrop(folder: Path, clients: int) -> AsyncIterator[Served]:
    """The real application, its vehicles and its disk left out."""
    clock = SystemClock()
    async with open_storage(folder / "bench.db") as storage, open_sender(version="bench") as sender:
        journal = Journal(ListStore(), clock)
        await journal.start()
        fleet = Fleet(NoVehicles(), journal)
        plans = Plans(KnownPlans(storage.plans), journal, clock)
        runs = Runs(fleet, plans, storage.runs, journal, clock, storage.flight_log)
        offboard = Offboard(fleet, runs, clock)
        services = ApiServices(
            journal=journal,
            plans=plans,
            jobs=Jobs(storage.jobs, plans, runs, fleet, journal, clock),
            comparisons=Comparisons(runs, journal),
            attachments=Attachments(runs, storage.attachments, journal, clock),
            delivery_reports=DeliveryReports(runs, storage.plans, storage.attachments, journal, clock, "gw-1"),
            access=Access(storage.tokens, clock, None),
            fleet=fleet,
            runs=runs,
            rerouting=Rerouting(runs, plans),
            targets=Targets(clock),
            commands=VehicleCommands(fleet, journal),
            links=VehicleLinks(NoGuards(), fleet, journal),
            offboard=offboard,
            tasks=Tasks(offboard, fleet, runs, clock),
            simulation=Simulation(None, fleet, runs, journal),
            webhooks=Webhooks(storage.webhooks, storage.plans, journal, sender, clock, "gw-1"),
            answers=storage.answers,
            audit=Audit(journal, storage.refusals, storage.tokens, clock),
            loop_watch=LoopWatch(journal),
            clock=clock,
        )
        # nothing paces the events here, so a queue of the usual size would cut clients that are merely busy
        settings = ApiSettings(
            gateway="gw-1",
            version="bench",
            telemetry_period_s=3600.0,
            max_sockets=clients,
            max_sockets_per_token=clients,
            socket_queue=100_000,
            heartbeat_s=3600.0,  # they answer no pings
        )
        app = build_app(services, settings)
        async with served(app, "/api/v1/stream", clients) as process:
            yield Served(lambda events: journal.record(*events), process)
        await journal.close()


@asynccontextmanager
async def bare_loop(clients: int) -> AsyncIterator[Served]:
    """The floor."""
    sockets: list[web.WebSocketResponse] = []

    async def handler(request: web.Request) -> web.StreamResponse:
        socket = web.WebSocketResponse(compress=False)
        await socket.prepare(request)
        sockets.append(socket)
        await socket.receive()
        return socket

    async def send(events: Sequence[NewEvent]) -> None:
        for event in numbered(events, 1):
            text = f'{{"type":"event","event":{event.model_dump_json()}}}'
            for socket in sockets:
                await socket.send_str(text)

    app = web.Application()
    app.router.add_get("/", handler)
    async with served(app, "/", clients) as process:
        yield Served(send, process)


@asynccontextmanager
async def served(app: web.Application, path: str, clients: int) -> AsyncIterator[asyncio.subprocess.Process]:
    """Serve on a free port with `clients` sockets connected."""
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=1.0)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "bench.fanout_clients", str(runner.addresses[0][1]), path, str(clients)),
        stdout=asyncio.subprocess.PIPE,
    )
    try:
        await read_word(process, "ready")
        yield process
    finally:
        process.terminate()
        await process.wait()
        await runner.cleanup()


async def read_word(process: asyncio.subprocess.Process, word: str) -> None:
    """Wait until the clients say something."""
    if process.stdout is None:
        raise RuntimeError("the clients have no output")
    async with asyncio.timeout(60):
        line = (await process.stdout.readline()).decode().strip()
    if line != word:
        raise RuntimeError(f"the clients said {line!r} and not {word!r}: was one of them cut?")


async def messages_per_cpu_s(server: Served, burst: int, turn: int) -> float:
    """Send events in bursts, until the last one is at the last client."""
    count = EVENTS if burst > 1 else EVENTS_ONE_BY_ONE
    return CLIENTS * count / await cpu_s(server, count, burst, turn)


async def cpu_s(server: Served, count: int, burst: int, turn: int) -> float:
    """What this process takes for it."""

    def new(number: int) -> NewEvent:
        note = last_marker(turn) if number == count - 1 else "x" * 60
        read_word = RunItem(item_id=note, seq=number, phase="reached")
        return NewEvent.of(read_word, 1.5, vehicle_id="v1", run_id="run-1")

    batches = [[new(n) for n in range(first, min(first + burst, count))] for first in range(0, count, burst)]
    begun_s = time.process_time()
    for batch in batches:
        await server.send(batch)
    await read_word(server.clients, f"seen {turn}")
    return time.process_time() - begun_s


@asynccontextmanager
async def prepared(burst: int) -> AsyncIterator[Round]:
    """Both servers, each with its clients."""
    turns = itertools.count(1)
    with tempfile.TemporaryDirectory() as folder:
        async with waydrop(Path(folder), CLIENTS) as ours, bare_loop(CLIENTS) as floor:

            async def measure() -> Pair:
                turn = next(turns)
                return Pair(await messages_per_cpu_s(ours, burst, turn), await messages_per_cpu_s(floor, burst, turn))

            await measure()
            yield measure


def row(burst: int, goal: float, limited_by: str) -> Row:
    """Events that are recorded so many at once."""
    return Row(
        name=f"fanout-{burst}",
        title=f"events to {CLIENTS} websockets, {burst} recorded at once",
        floor="a bare aiohttp loop, the frame encoded once",
        unit="messages/s CPU",
        goal=Goal(goal, "at least"),
        prepare=lambda scale: prepared(burst),
        limited_by=limited_by,
        rounds=9,
    )


ROWS: Final = (
    row(1, 0.9, "a system call for each socket"),
    row(10, 3.0, "a system call for each socket"),
    row(100, 3.0, "making the frames: events, JSON"),
)
