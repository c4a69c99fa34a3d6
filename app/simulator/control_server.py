"""The control socket: TCP on loopback, one JSON object a line in, one a line out."""

from __future__ import annotations

import asyncio
import json

from app.simulator.fault_control import Answer, FaultControl

LOOPBACK = "127.0.0.1"
MAX_LINE_BYTES = 65536


class ControlServer:
    """Serves any number of clients, one request of each at a time."""

    def __init__(self, control: FaultControl) -> None:
        self._control = control
        self._server: asyncio.Server | None = None
        self._clients: set[asyncio.StreamWriter] = set()

    async def open(self, port: int) -> int:
        """Listen; returns the port (useful with port 0). Raises OSError when it is taken."""
        self._server = await asyncio.start_server(self._serve, LOOPBACK, port, limit=MAX_LINE_BYTES)
        return int(self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Stop listening and drop the clients."""
        if self._server is not None:
            self._server.close()
        for writer in self._clients:
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._clients.add(writer)
        try:
            while line := await _read_line(reader):
                answer = await self._answer(line)
                writer.write(json.dumps(answer).encode() + b"\n")
                await writer.drain()
        except (ConnectionError, asyncio.CancelledError):
            pass  # the client left, or we do
        finally:
            self._clients.discard(writer)
            writer.close()

    async def _answer(self, line: bytes) -> Answer:
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            return {"ok": False, "error": "not a JSON object"}
        return await self._control.handle(request)


async def _read_line(reader: asyncio.StreamReader) -> bytes:
    """The next line; empty at the end, or when a line is too long to be a request."""
    try:
        return await reader.readline()
    except ValueError:
        return b""
