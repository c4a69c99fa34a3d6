"""One event websocket: hello, snapshot, replay, then live. One writer and one bounded outbox."""

from __future__ import annotations

import asyncio
import sys
from bisect import bisect_right
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import aclosing
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final, Self

import structlog
from aiohttp import WSMsgType, web
from pydantic import Field, TypeAdapter, model_validator
from pydantic_core import PydanticCustomError, to_json

from app.api.bodies import read_query
from app.api.observability import Metrics
from app.api.ports import FleetApi, RunsApi
from app.api.settings import ApiSettings
from app.api.stream.frames import CLOSE_REASONS, HelloFrame, SnapshotFrame, event_frame, text_frame
from app.api.websockets import (
    MAX_UNSENT_BYTES,
    CloseCode,
    SocketSession,
    WebSocketHandshake,
    bound_kernel_buffer,
    require_handshake,
    wait_until_writable,
)
from app.domain.errors import EventsPrunedError, StorageError
from app.domain.model import FrozenForm
from app.domain.ports.journal import EventReader
from app.services.access import Access, Role
from app.services.background import end_tasks
from app.services.clock import Clock
from app.services.journal import (
    SubscriptionClosedError,
    SubscriptionOverflowError,
    first_seq,
    follow,
    kept_after,
    kept_page,
)
from app.services.views import StateView

_STATES: Final = TypeAdapter(dict[str, StateView])


@dataclass(frozen=True)
class Tick:
    """The state of each vehicle, at one tick. The frame is built once for all sockets that send it."""

    time: float
    recording: bool
    states: Mapping[str, StateView]

    @cached_property
    def frame(self) -> bytes:
        head = b'{"type":"telemetry","time":' + to_json(self.time) + b',"recording":' + to_json(self.recording)
        return text_frame(head + b',"vehicles":' + _STATES.dump_json(dict(self.states)) + b"}")

    def over(self, older: Tick) -> Tick:
        """Merge an older tick that was never sent into this one."""
        if older.states.keys() <= self.states.keys():
            return self
        return Tick(self.time, self.recording, {**older.states, **self.states})


@dataclass(frozen=True)
class Batch:
    """Consecutive events, as positions and frames. They are joined once for all sockets that send all of them."""

    positions: Sequence[int]
    frames: Sequence[bytes]

    @cached_property
    def joined(self) -> bytes:
        """Return all frames, for one write."""
        return b"".join(self.frames)

    def after(self, position: int) -> Sequence[bytes]:
        """Return the frames of the events after `position`."""
        return self.frames[bisect_right(self.positions, position) :]


# The outbox of a socket: a bounded queue of events, and the newest telemetry.


class Connection:
    """Writes frames to a client.

    It bypasses aiohttp's writer, which would build each frame per client and make a system call for each.
    """

    def __init__(self, socket: web.WebSocketResponse, transport: asyncio.WriteTransport) -> None:
        self._socket = socket
        self._transport = transport

    def write_at_once(self, data: bytes) -> bool:
        """Write `data` if the client keeps up; False if it does not, or is gone."""
        if self._is_closed() or self._transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
            return False
        self._transport.write(data)
        return True

    async def write(self, data: bytes, timeout_s: float) -> None:
        """Write `data` when there is room. Raises TimeoutError if the client reads too slowly, ConnectionError."""
        await wait_until_writable(self._transport, timeout_s)
        if self._is_closed():
            raise ConnectionResetError("the socket is closed: no frame may follow the close frame")
        self._transport.write(data)

    def _is_closed(self) -> bool:
        return self._socket.closed or self._transport.is_closing()


class Outbox(SocketSession):
    """Filled by the broadcast.

    While the writer waits in `take`, the broadcast writes to the connection itself, which saves a task switch for each
    socket. As soon as the client falls behind, frames are queued, and the writer sends them.
    """

    def __init__(self, capacity: int, connection: Connection) -> None:
        super().__init__()
        self._capacity = capacity
        self._connection = connection
        self._after = 0
        self._events: deque[bytes] = deque()
        self._tick: Tick | None = None
        self._filled = asyncio.Event()
        self._is_idle = False

    def begin_after(self, seq: int) -> None:
        """Skip events up to `seq`: they were already sent."""
        self._after = seq

    def end(self, code: CloseCode) -> None:
        """Close the socket with `code` and drop what is queued. Only the first call has an effect."""
        super().end(code)
        self._events.clear()
        self._is_idle = False

    def send_events(self, batch: Batch) -> None:
        """Write or queue events. An overflow ends the session, because no event may be skipped."""
        is_whole = batch.positions[0] > self._after
        if is_whole and self._is_idle and self._connection.write_at_once(batch.joined):
            return
        frames = batch.frames if is_whole else batch.after(self._after)
        if not frames or self.ended.done():
            return
        if len(self._events) + len(frames) > self._capacity:
            self.end(CloseCode.TOO_SLOW)
            return
        self._events.extend(frames)
        self._wake()

    def send_tick(self, tick: Tick) -> None:
        """Write telemetry, or replace telemetry that has not been sent."""
        if self._is_idle and self._connection.write_at_once(tick.frame):
            return
        self._tick = tick if self._tick is None else tick.over(self._tick)
        self._wake()

    async def take(self) -> list[bytes]:
        """Return all queued frames, events first. Waits for at least one."""
        self._is_idle = not self._filled.is_set()
        await self._filled.wait()
        self._filled.clear()
        frames = list(self._events)
        self._events.clear()
        if self._tick is not None:
            frames.append(self._tick.frame)
            self._tick = None
        return frames

    def _wake(self) -> None:
        self._is_idle = False
        self._filled.set()


SUBSCRIPTION_CAPACITY: Final = 8192
FRAMES_AT_ONCE: Final = 64
"""Frames per write. A system call costs more than copying."""

RETRY_S: Final = 1.0
log = structlog.get_logger(__name__)


class Broadcast:
    """One reader of the journal and one of the telemetry, for all sockets. It never waits for a socket.

    `last_seq` is the newest event that was broadcast. A socket that has sent exactly these joins without an await.
    The events of one commit are sent together. The vehicles are looked at every `telemetry_period_s` while there is a
    socket.
    """

    def __init__(
        self, journal: EventReader, fleet: FleetApi, clock: Clock, metrics: Metrics, telemetry_period_s: float
    ) -> None:
        self._journal = journal
        self._fleet = fleet
        self._telemetry_period_s = telemetry_period_s
        self._clock = clock
        self._metrics = metrics
        self._outboxes: set[Outbox] = set()
        self._pending: list[tuple[int, bytes]] = []
        self._tasks: tuple[asyncio.Task[None], ...] = ()
        self.last_seq = 0

    def start(self) -> None:
        """Start after the newest event of the journal."""
        self.last_seq = self._journal.last_seq
        self._tasks = (
            asyncio.create_task(self._send_events(), name="event broadcast"),
            asyncio.create_task(self._send_telemetry(), name="telemetry broadcast"),
        )

    async def close(self) -> None:
        """Stop. Idempotent."""
        for task in self._tasks:
            task.cancel()
        for result in await asyncio.gather(*self._tasks, return_exceptions=True):
            if isinstance(result, Exception):
                log.error("broadcast failed", exc_info=result)
        self._tasks = ()

    def why_not_ready(self) -> str | None:
        """For /readyz: None while both tasks run."""
        dead = [task.get_name() for task in self._tasks if task.done()]
        return f"stopped: {', '.join(dead)}" if dead or not self._tasks else None

    def join(self, outbox: Outbox) -> None:
        """Send `outbox` everything from now on."""
        self._send_pending()
        self._outboxes.add(outbox)

    def leave(self, outbox: Outbox) -> None:
        """Stop sending. Idempotent."""
        self._outboxes.discard(outbox)

    async def _send_events(self) -> None:
        while True:
            try:
                await self._follow()
            except SubscriptionOverflowError:
                log.warning("broadcast fell behind the journal; reading from disk", after=self.last_seq)
            except SubscriptionClosedError:
                return
            except StorageError as error:
                log.error("broadcast cannot read the journal", error=error.detail)
                await asyncio.sleep(RETRY_S)

    async def _follow(self) -> None:
        loop = asyncio.get_running_loop()
        async with aclosing(follow(self._journal, self.last_seq, capacity=SUBSCRIPTION_CAPACITY)) as events:
            async for event in events:
                if not self._pending:
                    # the events of one commit arrive without a break, so this runs when all of them are here
                    loop.call_soon(self._send_pending)
                self._pending.append((event.position, event_frame(event)))
                self.last_seq = event.position
                self._metrics.count_event(event.kind.value)
                if len(self._pending) >= FRAMES_AT_ONCE:
                    self._send_pending()

    def _send_pending(self) -> None:
        if not self._pending:
            return
        batch = Batch(*zip(*self._pending, strict=True))
        self._pending.clear()
        for outbox in self._outboxes:
            outbox.send_events(batch)

    async def _send_telemetry(self) -> None:
        while True:
            await asyncio.sleep(self._telemetry_period_s)
            if not self._outboxes:
                continue
            states = {vehicle.id: vehicle.state for vehicle in self._fleet.vehicles()}
            tick = Tick(self._clock.now(), self._journal.healthy, states)
            self._send_pending()  # an event is never later than the telemetry after it
            for outbox in self._outboxes:
                outbox.send_tick(tick)


MAX_INCOMING_FRAMES: Final = 100
"""Frames that a client may send before the socket is closed. Nothing reads them."""


@dataclass(frozen=True, slots=True)
class Sources:
    """The sources of a session's data."""

    journal: EventReader
    fleet: FleetApi
    runs: RunsApi
    clock: Clock
    broadcast: Broadcast


class Session:
    """One client. The broadcast fills `outbox` once the client has caught up with the journal."""

    def __init__(
        self,
        socket: web.WebSocketResponse,
        transport: asyncio.WriteTransport,
        sources: Sources,
        settings: ApiSettings,
    ) -> None:
        self._socket = socket
        self._connection = Connection(socket, transport)
        self._sources = sources
        self._settings = settings
        self.outbox = Outbox(settings.socket_queue, self._connection)

    async def run(self, after: int | None) -> CloseCode | None:
        """Serve until either side ends the session. Returns the close code, None if the client has gone.

        Raises StorageError.
        """
        if after is not None and not await self._sources.journal.has(after):
            return CloseCode.AFTER_AHEAD
        writer = asyncio.create_task(self._write(after), name="socket writer")
        reader = asyncio.create_task(self._read(), name="socket reader")
        try:
            await asyncio.wait((writer, reader, self.outbox.ended), return_when=asyncio.FIRST_COMPLETED)
            if self.outbox.ended.done():
                return self.outbox.ended.result()
            return await (writer if writer.done() else reader)
        finally:
            self._sources.broadcast.leave(self.outbox)
            await end_tasks(writer, reader)

    async def _read(self) -> CloseCode | None:
        """Clients send only pongs and a close frame, which aiohttp handles."""
        for _ in range(MAX_INCOMING_FRAMES):
            message = await self._socket.receive()
            if message.type not in (WSMsgType.TEXT, WSMsgType.BINARY):
                return None
        return CloseCode.POLICY

    async def _write(self, after: int | None) -> CloseCode | None:
        try:
            cursor = await self._introduce()
            await self._catch_up(cursor if after is None else kept_after(self._sources.journal, after))
            while True:
                await self._send(await self.outbox.take())
        except EventsPrunedError:
            return CloseCode.AFTER_PRUNED
        except TimeoutError:
            return CloseCode.TOO_SLOW
        except ConnectionError:
            return None

    async def _introduce(self) -> int:
        """Send hello and snapshot. Returns the seq of hello."""
        seq = self._sources.journal.last_seq
        hello = HelloFrame(
            gateway=self._settings.gateway,
            first_seq=first_seq(self._sources.journal),
            seq=seq,
            server_time=self._sources.clock.now(),
        )
        runs = await self._sources.runs.open_and_recent(self._settings.recent_runs)
        # read after seq: an event in between appears both in the snapshot and as an event, never in neither
        snapshot = SnapshotFrame(
            seq=seq,
            vehicles=list(self._sources.fleet.vehicles()),
            runs=list(runs),
        )
        await self._send([text_frame(frame.model_dump_json().encode()) for frame in (hello, snapshot)])
        return seq

    async def _catch_up(self, cursor: int) -> None:
        """Send the events after `cursor`, then join the broadcast exactly there."""
        broadcast = self._sources.broadcast
        while cursor < broadcast.last_seq:
            page = await kept_page(self._sources.journal, cursor, self._settings.replay_page_events)
            if not page:
                raise StorageError(f"the journal returned no event after {cursor} although newer events exist")
            await self._send([event_frame(event) for event in page])
            cursor = page[-1].position
        # no await between the comparison above and joining, so no event can be missed
        self.outbox.begin_after(cursor)
        broadcast.join(self.outbox)

    async def _send(self, frames: Sequence[bytes]) -> None:
        """Write frames in one call. Raises TimeoutError if the client reads too slowly."""
        for first in range(0, len(frames), FRAMES_AT_ONCE):
            data = b"".join(frames[first : first + FRAMES_AT_ONCE])
            await self._connection.write(data, self._settings.send_timeout_s)


class StreamQuery(FrozenForm):
    """Where to begin: behind event `after` of the journal that `gateway` of hello named."""

    after: Annotated[str, Field(pattern=r"^[0-9]{1,16}$")] | None = None
    gateway: str | None = None

    @model_validator(mode="after")
    def _a_gateway_belongs_to_a_position(self) -> Self:
        if self.gateway is not None and self.after is None:
            raise PydanticCustomError("after_missing", "gateway is the journal that after counts in: give both")
        return self

    def position(self) -> tuple[int | None, str | None]:
        """The number of the event and its journal."""
        return None if self.after is None else int(self.after), self.gateway


class StreamEndpoint:
    """GET /api/v1/stream. Errors are close codes, because browsers do not expose the HTTP status of a handshake."""

    def __init__(self, sources: Sources, access: Access, metrics: Metrics, settings: ApiSettings) -> None:
        self._sources = sources
        self._settings = settings
        self._handshake = WebSocketHandshake(
            "socket", CLOSE_REASONS, access, metrics, settings, max_sockets=settings.max_sockets
        )
        self.close = self._handshake.close

    async def stream(self, request: web.Request) -> web.StreamResponse:
        """Return the handler."""
        require_handshake(request, hint="open a websocket, or read events page by page with GET /api/v1/events")
        return await self._handshake.open(
            request,
            lambda socket, _: self._serve(request, socket),
            role=Role.VIEWER,
            heartbeat_s=self._settings.heartbeat_s,
            writer_limit=sys.maxsize,  # never wait inside aiohttp: see wait_until_writable
        )

    async def _serve(self, request: web.Request, socket: web.WebSocketResponse) -> CloseCode | None:
        after, gateway = read_query(request, StreamQuery).position()
        transport = request.transport
        if transport is None:
            return None
        if gateway is not None and gateway != self._settings.gateway:
            return CloseCode.AFTER_AHEAD
        bound_kernel_buffer(transport, self._settings.socket_buffer_bytes)
        session = Session(socket, transport, self._sources, self._settings)
        return await self._handshake.run_session(request, session.outbox, lambda: session.run(after))
