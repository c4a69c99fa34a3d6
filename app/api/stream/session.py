"""One websocket from its handshake to its end: hello, snapshot, replay, then live. One writer, one bounded outbox."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from aiohttp import WSMsgType, web

from app.api.settings import ApiSettings
from app.api.stream.broadcast import Broadcast
from app.api.stream.frames import CloseCode, HelloFrame, SnapshotFrame, event_frame, text_frame
from app.api.stream.outbox import Outbox
from app.api.write_room import wait_for_room
from app.domain.errors import StorageError
from app.domain.run import Run
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.runs import Runs

MAX_INCOMING_FRAMES: Final = 100
"""Frames that a client may send although nobody reads them; then it is closed."""

FRAMES_AT_ONCE: Final = 64
"""Frames in one write: a system call costs more than copying them."""


@dataclass(frozen=True, slots=True)
class Sources:
    """What a session shows."""

    journal: Journal
    fleet: Fleet
    runs: Runs
    clock: Clock
    broadcast: Broadcast


class Session:
    """One client. `outbox` is filled for it once it has caught up with the journal."""

    def __init__(
        self,
        socket: web.WebSocketResponse,
        transport: asyncio.WriteTransport,
        sources: Sources,
        settings: ApiSettings,
    ) -> None:
        self._socket = socket
        self._transport = transport
        self._sources = sources
        self._settings = settings
        self.outbox = Outbox(settings.socket_queue)

    async def run(self, after: int | None) -> CloseCode | None:
        """Serve until one side ends it. The code to close with, None if the client has gone. May raise StorageError."""
        if after is not None and after > self._sources.journal.last_seq:
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
            writer.cancel()
            reader.cancel()
            await asyncio.gather(writer, reader, return_exceptions=True)

    async def _read(self) -> CloseCode | None:
        """Nothing is expected of the client but pongs and its close; aiohttp answers those."""
        for _ in range(MAX_INCOMING_FRAMES):
            message = await self._socket.receive()
            if message.type not in (WSMsgType.TEXT, WSMsgType.BINARY):
                return None
        return CloseCode.POLICY

    async def _write(self, after: int | None) -> CloseCode | None:
        try:
            cursor = await self._introduce()
            await self._catch_up(cursor if after is None else after)
            while True:
                await self._send(await self.outbox.take())
        except TimeoutError:
            return CloseCode.TOO_SLOW
        except ConnectionError:
            return None

    async def _introduce(self) -> int:
        """Send hello and snapshot. Returns hello's seq."""
        seq = self._sources.journal.last_seq
        hello = HelloFrame(gateway=self._settings.gateway, seq=seq, server_time=self._sources.clock.now())
        recent = await self._sources.runs.list_runs(self._settings.recent_runs)
        # read after seq was: what happens meanwhile is in the snapshot and comes as an event too, never in neither
        snapshot = SnapshotFrame(
            seq=seq,
            vehicles=list(self._sources.fleet.vehicles()),
            runs=_open_and_recent(self._sources.runs.open_runs(), recent),
        )
        await self._send([text_frame(frame.model_dump_json().encode()) for frame in (hello, snapshot)])
        return seq

    async def _catch_up(self, cursor: int) -> None:
        """Send what the journal has after `cursor`, then join the broadcast at exactly that place."""
        broadcast = self._sources.broadcast
        while cursor < broadcast.last_seq:
            page = await self._sources.journal.read(cursor, self._settings.replay_page_events)
            if not page:
                raise StorageError(f"the journal has nothing after {cursor} but should")
            await self._send([event_frame(event) for event in page])
            cursor = page[-1].seq
        # no await between the comparison above and joining: no event can come in between
        self.outbox.begin_after(cursor)
        broadcast.join(self.outbox)

    async def _send(self, frames: Sequence[bytes]) -> None:
        """Write frames, many at once. Raises TimeoutError if the client takes nothing for too long."""
        for first in range(0, len(frames), FRAMES_AT_ONCE):
            await wait_for_room(self._transport, self._settings.send_timeout_s)
            if self._socket.closed or self._transport.is_closing():
                raise ConnectionResetError("the socket is closed: no frame may follow the close frame")
            # past aiohttp's own writer, which would make each frame's header for each client, and a system call
            self._transport.write(b"".join(frames[first : first + FRAMES_AT_ONCE]))


def _open_and_recent(open_runs: Sequence[Run], recent: Sequence[Run]) -> list[Run]:
    """Each run once, newest first; of one that is in both, the open one is newer."""
    by_id = {run.id: run for run in (*recent, *open_runs)}
    return sorted(by_id.values(), key=lambda run: run.created_at, reverse=True)
