"""A link guard between a vehicle's end and mavsdk's end, both in the hands of a test."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import time
import tty
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Protocol
from urllib.parse import urlsplit

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.guard import LinkGuard
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.options import parse_connection
from tests.support.patience import Patience
from tests.support.simulated import free_udp_ports

LOOPBACK = "127.0.0.1"
WITHIN_S = 5.0


class End(Protocol):
    """One end of a link."""

    def send(self, frame: bytes) -> None: ...

    def received(self) -> bytes: ...

    def close(self) -> None: ...


class UdpEnd:
    """A UDP socket on an address of its own; `to` is where it sends."""

    def __init__(self, to: tuple[str, int] | None = None, *, address: str = LOOPBACK, port: int = 0) -> None:
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.setblocking(False)
        self.sock.bind((address, port))
        self.to = to

    @property
    def port(self) -> int:
        return int(self.sock.getsockname()[1])

    def send(self, frame: bytes) -> None:
        assert self.to is not None
        self.sock.sendto(frame, self.to)

    def received(self) -> bytes:
        data = b""
        with contextlib.suppress(BlockingIOError):
            while True:
                part, source = self.sock.recvfrom(65_535)
                self.to = self.to or source
                data += part
        return data

    def close(self) -> None:
        self.sock.close()


class TcpEnd:
    """A TCP connection that was made from either side."""

    def __init__(self, sock: socket.socket) -> None:
        sock.setblocking(False)
        self.sock = sock

    def send(self, frame: bytes) -> None:
        self.sock.sendall(frame)

    def received(self) -> bytes:
        data = b""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while part := self.sock.recv(65_535):
                data += part
        return data

    def close(self) -> None:
        self.sock.close()


class SerialEnd:
    """The far end of a serial cable: a pseudo-terminal."""

    def __init__(self) -> None:
        self.fd, other = os.openpty()
        tty.setraw(self.fd)
        os.set_blocking(self.fd, False)
        self.device = os.ttyname(other)
        self._other = other

    def send(self, frame: bytes) -> None:
        os.write(self.fd, frame)

    def received(self) -> bytes:
        data = b""
        with contextlib.suppress(BlockingIOError):
            while part := os.read(self.fd, 65_535):
                data += part
        return data

    def close(self) -> None:
        for fd in (self.fd, self._other):
            with contextlib.suppress(OSError):
                os.close(fd)


class Guarded:
    """The guard and the end where mavsdk would be."""

    def __init__(self, guard: LinkGuard, mavsdk: UdpEnd) -> None:
        self.guard = guard
        self.mavsdk = mavsdk

    def refused(self, kind: RefusalKind) -> int:
        """How often, so far."""
        return sum(refused.count for refused in self.guard.refused() if refused.kind is kind)


@asynccontextmanager
async def guarded(url: str, store: SigningStore | None = None) -> AsyncIterator[Guarded]:
    """A guard on `url`, ticked as its source does."""
    guard = LinkGuard(parse_connection(url), store or SigningStore(), 0)
    await guard.open()
    port = urlsplit(guard.inner_url).port or 0
    mavsdk = UdpEnd.__new__(UdpEnd)
    mavsdk.sock, mavsdk.to = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), None
    mavsdk.sock.setblocking(False)
    mavsdk.sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    mavsdk.sock.bind((LOOPBACK, port))
    guard.begin()
    ticking = asyncio.create_task(_tick(guard))
    try:
        yield Guarded(guard, mavsdk)
    finally:
        ticking.cancel()
        await asyncio.gather(ticking, return_exceptions=True)
        guard.close()
        mavsdk.close()


async def _tick(guard: LinkGuard) -> None:
    while True:
        guard.tick(time.monotonic())
        await asyncio.sleep(0.05)


async def arrives(
    end: End, frame: bytes, again: Callable[[], None] = lambda: None, *, within_s: float = WITHIN_S
) -> None:
    """Wait until these bytes come out at an end. `again` is called now and then, for links that lose what is early."""
    await heard_until(end, frame, again, within_s=within_s)


async def heard_until(end: End, frame: bytes, again: Callable[[], None], *, within_s: float = WITHIN_S) -> bytes:
    """As `arrives`; all that came out until then."""
    data, patience, again_s = b"", Patience(within_s), 0.0
    while frame not in data:
        now_s = time.monotonic()
        assert not patience.is_over(), f"the frame must arrive within {within_s:g} s; {len(data)} bytes did"
        if now_s >= again_s:
            again()
            again_s = now_s + 0.2
        await asyncio.sleep(0.005)
        data += end.received()
    return data


async def stays_silent(end: End, frame: bytes, for_s: float = 0.3) -> None:
    """These bytes do not come out at an end."""
    data, until_s = b"", time.monotonic() + for_s
    while time.monotonic() < until_s:
        await asyncio.sleep(0.01)
        data += end.received()
    assert frame not in data


@asynccontextmanager
async def udpin(query: str = "", store: SigningStore | None = None) -> AsyncIterator[tuple[Guarded, UdpEnd]]:
    """A guarded UDP port, and a vehicle that sends to it."""
    port = free_udp_ports(1)
    vehicle = UdpEnd((LOOPBACK, port))
    async with guarded(f"udpin://{LOOPBACK}:{port}{query}", store) as link:
        yield link, vehicle
    vehicle.close()
