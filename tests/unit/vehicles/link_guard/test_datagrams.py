"""The age of a datagram that waited for the event loop."""

import asyncio
import itertools
import socket
import struct
import time
from collections import deque
from collections.abc import Iterator
from typing import Any

import pytest

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.datagrams import LATE_S, TURN_S, DatagramReader, udp_socket
from app.vehicles.link_guard.options import ConnectionOptions
from app.vehicles.link_guard.policy import Peer
from app.vehicles.link_guard.udp import UdpClient, UdpListener
from tests.support.simulated import free_udp_ports

STALL_S = 0.3
"""More than may pass before a datagram is late."""

STAMPED_S = 0.02
"""A datagram that waited so long and whose stamp is as old was stamped as it arrived."""


@pytest.fixture(autouse=True)
def arrivals_are_stamped() -> Iterator[None]:
    """
    The kernel begins to stamp arrivals some time after the first socket of the machine asked for it; until then it
    stamps a datagram as it is read. This socket asks for it, until the test has ended.
    """
    with udp_socket(socket.AF_INET) as first, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as transport:
        first.bind(("127.0.0.1", 0))
        give_up_s = time.monotonic() + 20
        while True:
            transport.sendto(b"probe", first.getsockname())
            time.sleep(STAMPED_S)
            _data, ((_level, _kind, stamp),), _flags, _address = first.recvmsg(16, 64)
            seconds, nanoseconds = struct.unpack("@ll", stamp)
            if time.clock_gettime(time.CLOCK_REALTIME) - seconds - nanoseconds / 1e9 >= STAMPED_S:
                break
            assert time.monotonic() < give_up_s, "the kernel stamps no arrivals"
        yield


async def heard_late(*, waits: bool) -> bool:
    """Whether a datagram counts as late that arrives before the loop stands still, or after it."""
    heard: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
    inside = udp_socket(socket.AF_INET)
    inside.bind(("127.0.0.1", 0))
    reader = DatagramReader(inside, lambda _data, _address, late: heard.set_result(late))
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as transport:
            if waits:
                transport.sendto(b"command", inside.getsockname())
            time.sleep(STALL_S)  # noqa: ASYNC251  the loop stands still
            if not waits:
                transport.sendto(b"command", inside.getsockname())
            async with asyncio.timeout(20):
                return await heard
    finally:
        reader.close()


async def test_what_waited_for_a_loop_that_stood_still_is_late() -> None:
    assert await heard_late(waits=True)


@pytest.mark.parametrize("jump_s", [-90_000.0, 0.0, 90_000.0])
async def test_what_arrives_after_a_stall_is_not_late_whatever_the_service_takes_for_the_time(
    jump_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel stamps arrivals by CLOCK_REALTIME; the age must be by that clock and no other."""
    unshifted = time.time
    monkeypatch.setattr(time, "time", lambda: unshifted() + jump_s)
    assert not await heard_late(waits=False)


READ_S, JUDGED_S = 0.000_01, 0.001
"""What it costs to read a datagram, and to judge it."""


class Clock:
    """Goes on by what is done alone."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = 1_000_000.0
        monkeypatch.setattr(time, "monotonic", lambda: self.now_s)
        monkeypatch.setattr(time, "clock_gettime", lambda _clock: self.now_s)


class BusySocket(socket.socket):
    """Datagrams that arrive at these times, of which a full queue holds 1,000."""

    def __init__(self, clock: Clock, arrivals: Iterator[float]) -> None:
        super().__init__(socket.AF_INET, socket.SOCK_DGRAM)
        self.bind(("127.0.0.1", 0))
        self.sendto(b"never read, so that the loop always finds something", self.getsockname())
        self._clock = clock
        self._arrivals = arrivals
        self._next_s = next(arrivals)
        self._queue: deque[float] = deque()

    def recvfrom(self, size: int, flags: int = 0) -> tuple[bytes, Any]:  # type: ignore[override]
        self._arrive()
        self._queue.popleft()
        return b"frame", ("127.0.0.1", 14540)

    def recvmsg(self, size: int, ancillary: int = 0, flags: int = 0) -> tuple[bytes, list[Any], int, Any]:  # type: ignore[override]
        self._arrive()
        at_s = self._queue.popleft()
        stamp = struct.pack("@ll", int(at_s), int(at_s % 1 * 1e9))
        return b"frame", [(socket.SOL_SOCKET, 35, stamp)], 0, ("127.0.0.1", 14540)

    def _arrive(self) -> None:
        self._clock.now_s += READ_S
        while self._next_s <= self._clock.now_s:
            if len(self._queue) < 1000:
                self._queue.append(self._next_s)
            self._next_s = next(self._arrivals, float("inf"))
        if not self._queue:
            raise BlockingIOError


@pytest.mark.parametrize("every_s", [JUDGED_S / 2, JUDGED_S / 20])
async def test_of_more_than_can_be_read_the_newest_pass(monkeypatch: pytest.MonkeyPatch, every_s: float) -> None:
    clock = Clock(monkeypatch)
    begun_s = clock.now_s
    taken: list[bool] = []
    skipped: list[object] = []
    turns_s = [begun_s]
    ended = asyncio.get_running_loop().create_future()

    def take(_data: bytes, _address: object, late: bool) -> None:
        clock.now_s += JUDGED_S
        if clock.now_s - begun_s > 3.0:
            taken.append(late)
        if clock.now_s - begun_s > 6.0 and not ended.done():
            ended.set_result(None)

    sock = BusySocket(clock, itertools.count(begun_s, every_s))
    reader = DatagramReader(sock, take, lambda: turns_s.append(clock.now_s), skipped.append)
    await ended
    reader.close()
    assert taken.count(False) > 0.9 * len(taken)
    assert len(taken) > 1000, "what is skipped must leave time for what is not"
    assert skipped
    assert max(end - begin for begin, end in itertools.pairwise(turns_s)) < TURN_S + 2 * JUDGED_S


@pytest.mark.parametrize(("judged_s", "again_s"), [(0.0005, 0.0), (0.0015, 0.0), (0.0005, 5.0)])
async def test_what_waited_for_a_loop_that_stood_still_is_taken_however_late(
    monkeypatch: pytest.MonkeyPatch, judged_s: float, again_s: float
) -> None:
    """An answer or a report counts then, too: nobody sends it again. Also if it takes long or the loop stalls again."""
    clock = Clock(monkeypatch)
    begun_s = clock.now_s
    taken: list[bool] = []
    skipped: list[object] = []
    ended = asyncio.get_running_loop().create_future()

    def take(_data: bytes, _address: object, late: bool) -> None:
        clock.now_s += judged_s
        taken.append(late)
        if len(taken) == 100:
            clock.now_s += again_s
        if len(taken) == 1000 and not ended.done():
            ended.set_result(None)

    def skip(address: object) -> None:
        skipped.append(address)
        if not ended.done():
            ended.set_result(None)

    arrivals = iter([begun_s + number / 1000 for number in range(1000)])
    reader = DatagramReader(BusySocket(clock, arrivals), take, skip=skip)
    clock.now_s += 5.0
    await ended
    reader.close()
    assert not skipped
    assert all(taken)


class Receiver:
    """A guard that has the vehicle send one more for each of its datagrams, and is told what was refused."""

    def __init__(self, clock: Clock, vehicle: socket.socket, *, owns: bool) -> None:
        self._clock = clock
        self._vehicle = vehicle
        self._owns = owns
        self.refused: asyncio.Future[RefusalKind] = asyncio.get_running_loop().create_future()

    def deliver(self, data: bytes, peer: Peer, late: bool) -> int:
        self._clock.now_s += 0.01
        self._vehicle.send(data)
        return 1

    def flush(self) -> None:
        pass

    def refuse(self, kind: RefusalKind, peer: Peer) -> None:
        assert peer.name == f"127.0.0.1:{self._vehicle.getsockname()[1]}"
        if not self.refused.done():
            self.refused.set_result(kind)

    def owns(self, peer: Peer) -> bool:
        return self._owns

    def systems_of(self, peer: Peer) -> int:
        return 1

    def lost(self, peer: Peer) -> None:
        pass


@pytest.mark.parametrize("way", ["a stranger's", "a vehicle's own socket", "udpout"])
async def test_what_is_skipped_is_told_as_refused(monkeypatch: pytest.MonkeyPatch, way: str) -> None:
    transport: UdpListener | UdpClient
    unshifted = time.clock_gettime
    with udp_socket(socket.AF_INET) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        clock = Clock(monkeypatch)
        late_s = 10 * LATE_S  # all that arrives is
        monkeypatch.setattr(time, "clock_gettime", lambda clock: unshifted(clock) + late_s)
        receiver = Receiver(clock, vehicle, owns=way != "a stranger's")
        if way == "udpout":
            transport = UdpClient(*vehicle.getsockname(), receiver)
            await transport.open()
            transport.send(*transport.awaiting_heartbeat(), b"hello")
            vehicle.setblocking(True)
            vehicle.connect(vehicle.recvfrom(16)[1])
        else:
            port = free_udp_ports(1)
            transport = UdpListener("127.0.0.1", port, ConnectionOptions(), receiver)
            await transport.open()
            vehicle.connect(("127.0.0.1", port))
        clock.now_s += 1.0
        vehicle.send(b"frame")
        assert await receiver.refused is RefusalKind.LATE
        transport.close()
