"""A client made of a bare TCP socket: it can send what no library would, and not read."""

from __future__ import annotations

import asyncio
import socket
import struct
from contextlib import suppress

from app.api.stream.frames import CLOSE_REASONS

HANDSHAKE = (
    "GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n"
)


async def exchange(port: int, request: bytes, *, timeout_s: float = 15.0) -> bytes:
    """Send bytes, and read until the server closes or has nothing more to say.

    A server that closes without having read all resets the connection behind its answer.
    """
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    answer = b""
    try:
        writer.write(request)
        await writer.drain()
        async with asyncio.timeout(timeout_s):
            while chunk := await reader.read(65536):
                answer += chunk
    except ConnectionResetError:
        if not answer:
            raise
    finally:
        writer.close()
    return answer


async def head_of(port: int, request: bytes, *, timeout_s: float = 15.0) -> bytes:
    """Send bytes, and read the head of the answer. A server that refuses a body waits long for its end."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        writer.write(request)
        async with asyncio.timeout(timeout_s):
            return await reader.readuntil(b"\r\n\r\n")
    finally:
        writer.close()


def status_of(answer: bytes) -> int:
    """The status of the first answer in some bytes."""
    line = answer.partition(b"\r\n")[0].split(b" ")
    assert line[0] in (b"HTTP/1.1", b"HTTP/1.0"), answer[:200]
    return int(line[1])


class DeafClient:
    """Opens the stream and reads nothing until it is asked to. Its receive buffer is small."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self._socket.setblocking(False)
        self._port = port

    async def open(self, path: str = "/api/v1/stream") -> None:
        """Complete the handshake; the answer stays unread."""
        loop = asyncio.get_running_loop()
        await loop.sock_connect(self._socket, ("127.0.0.1", self._port))
        await loop.sock_sendall(self._socket, HANDSHAKE.format(path=path).encode())

    async def send_forever(self, payload: bytes) -> None:
        """Send text frames (at most 125 bytes each, masked by zeros) until the server lets go."""
        loop, frame = asyncio.get_running_loop(), bytes((0x81, 0x80 | len(payload), 0, 0, 0, 0)) + payload
        with suppress(ConnectionError):
            while True:
                await loop.sock_sendall(self._socket, frame * 100)

    async def read_up_to(self, end: bytes, timeout_s: float = 20.0) -> bytes:
        """What the server has sent, until `end` is in it. Raises ConnectionError if the server closes before."""
        loop, data = asyncio.get_running_loop(), bytearray()
        async with asyncio.timeout(timeout_s):
            while end not in data:
                chunk = await loop.sock_recv(self._socket, 65536)
                if not chunk:
                    raise ConnectionResetError("the server has closed")
                data += chunk
        return bytes(data)

    async def read_to_the_end(self, timeout_s: float = 15.0) -> bytes:
        """All that the server has sent, up to its end."""
        loop, data = asyncio.get_running_loop(), bytearray()
        async with asyncio.timeout(timeout_s):
            while True:
                try:
                    chunk = await loop.sock_recv(self._socket, 65536)
                except ConnectionResetError:
                    return bytes(data)
                if not chunk:
                    return bytes(data)
                data += chunk

    def close(self) -> None:
        """Let go."""
        self._socket.close()


def close_frame(code: int) -> bytes:
    """The bytes of a server's close frame, with the words that go with its code."""
    payload = struct.pack("!H", code) + CLOSE_REASONS[code].encode()
    return bytes((0x88, len(payload))) + payload
