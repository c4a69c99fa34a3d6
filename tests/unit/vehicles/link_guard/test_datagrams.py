"""The age of a datagram that waited for the event loop."""

import asyncio
import socket
import struct
import time
from collections.abc import Iterator

import pytest

from app.vehicles.link_guard.datagrams import DatagramReader, udp_socket

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
