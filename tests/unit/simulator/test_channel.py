"""The way between vehicle and ground: losses, delays, doubles; and a vehicle that does not care who listens."""

from __future__ import annotations

import asyncio
import random
import socket
from collections.abc import Iterator

import pytest

from app.simulator.channel import Channel
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import LinkFaults

LOOPBACK = "127.0.0.1"


class Ground:
    """A bound UDP socket."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((LOOPBACK, 0))
        self.socket.setblocking(False)
        self.address: tuple[str, int] = self.socket.getsockname()

    def received(self) -> list[int]:
        """The custom_mode of every heartbeat that arrived."""
        parser = mavlink.MAVLink(None)
        found: list[int] = []
        while True:
            try:
                data = self.socket.recv(65535)
            except BlockingIOError:
                return found
            found += [message.custom_mode for message in parser.parse_buffer(data) or ()]


@pytest.fixture
def ground() -> Iterator[Ground]:
    ground = Ground()
    yield ground
    ground.socket.close()


class Ear:
    """Remembers what the vehicle was told."""

    def __init__(self) -> None:
        self.heard: list[Message] = []

    def __call__(self, channel: object, message: Message) -> None:
        self.heard.append(message)


async def open_channel(remote: tuple[str, int], faults: LinkFaults, ear: Ear, seed: int = 1) -> Channel:
    loop = asyncio.get_running_loop()
    channel = Channel(remote, faults, random.Random(seed), ear, loop.time)
    await loop.create_datagram_endpoint(lambda: channel, local_addr=(LOOPBACK, 0))
    return channel


def beat(number: int) -> Message:
    return mavlink.MAVLink_heartbeat_message(2, 12, 0, number, 3, 3)


async def eventually(condition: object) -> None:
    async with asyncio.timeout(5.0):
        while not condition():  # type: ignore[operator]
            await asyncio.sleep(0.005)


async def test_lost_datagrams_are_chosen_by_the_seed(ground: Ground) -> None:
    async def survivors(seed: int) -> list[int]:
        channel = await open_channel(ground.address, LinkFaults(loss=0.3), Ear(), seed)
        for number in range(100):
            channel.send(beat(number), 1, 1)
        channel.close()
        return ground.received()

    first = await survivors(7)
    assert 55 <= len(first) <= 85
    assert await survivors(7) == first
    assert await survivors(8) != first


async def test_a_delayed_datagram_comes_later_and_a_doubled_one_twice(ground: Ground) -> None:
    faults = LinkFaults(delay_s=0.05, duplicate=1.0)
    channel = await open_channel(ground.address, faults, Ear())
    channel.send(beat(5), 1, 1)
    assert ground.received() == []
    got: list[int] = []
    await eventually(lambda: got.extend(ground.received()) or len(got) == 2)
    assert got == [5, 5]
    channel.close()


async def test_a_reordered_datagram_comes_after_the_next(ground: Ground) -> None:
    faults = LinkFaults(reorder=1.0)
    channel = await open_channel(ground.address, faults, Ear())
    channel.send(beat(1), 1, 1)
    faults.reorder = 0.0
    channel.send(beat(2), 1, 1)
    got: list[int] = []
    await eventually(lambda: got.extend(ground.received()) or len(got) == 2)
    assert got == [2, 1]
    channel.close()


async def test_a_cut_link_passes_nothing_in_either_direction(ground: Ground) -> None:
    ear, faults = Ear(), LinkFaults(link_cut=True)
    channel = await open_channel(ground.address, faults, ear)
    channel.send(beat(1), 1, 1)
    host, port = channel.local_address.split(":")
    ground.socket.sendto(beat(9).pack(mavlink.MAVLink(None, srcSystem=245, srcComponent=190)), (host, int(port)))
    await asyncio.sleep(0)
    faults.link_cut = False
    ground.socket.sendto(beat(10).pack(mavlink.MAVLink(None, srcSystem=245, srcComponent=190)), (host, int(port)))
    await eventually(lambda: ear.heard)
    assert ground.received() == []
    assert [message.custom_mode for message in ear.heard][-1] == 10
    channel.close()


async def test_nobody_listening_is_no_error_and_a_later_listener_hears() -> None:
    closed = Ground()
    closed.socket.close()
    channel = await open_channel(closed.address, LinkFaults(), Ear())
    for number in range(20):
        channel.send(beat(number), 1, 1)
        await asyncio.sleep(0.001)
    late = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    late.bind(closed.address)
    late.setblocking(False)
    channel.send(beat(42), 1, 1)
    parsed = mavlink.MAVLink(None).parse_buffer(late.recv(65535))
    assert parsed[0].custom_mode == 42
    late.close()
    channel.close()


async def test_garbage_is_swallowed_and_the_next_message_is_understood(ground: Ground) -> None:
    ear = Ear()
    channel = await open_channel(ground.address, LinkFaults(), ear)
    host, port = channel.local_address.split(":")
    for rubbish in (b"", b"\xfd", b"GET / HTTP/1.1\r\n\r\n", bytes(range(256)) * 4):
        ground.socket.sendto(rubbish, (host, int(port)))
    packer = mavlink.MAVLink(None, srcSystem=245, srcComponent=190)
    for number in range(20):
        ground.socket.sendto(beat(number).pack(packer), (host, int(port)))
    await eventually(lambda: ear.heard and ear.heard[-1].custom_mode == 19)
    channel.close()


async def test_a_ground_station_that_speaks_first_becomes_the_remote_but_steals_no_living_link(ground: Ground) -> None:
    ear = Ear()
    channel = await open_channel((LOOPBACK, 9), LinkFaults(), ear)
    host, port = channel.local_address.split(":")
    packer = mavlink.MAVLink(None, srcSystem=245, srcComponent=190)
    ground.socket.sendto(beat(1).pack(packer), (host, int(port)))
    await eventually(lambda: channel.remote == ground.address)
    other = Ground()
    other.socket.sendto(beat(2).pack(packer), (host, int(port)))
    await eventually(lambda: len(ear.heard) == 2)
    assert channel.remote == ground.address
    other.socket.close()
    channel.close()


async def test_each_component_counts_its_own_sequence(ground: Ground) -> None:
    channel = await open_channel(ground.address, LinkFaults(), Ear())
    for component in (1, 169, 1):
        channel.send(beat(0), 1, component)
    sequences = []
    for _ in range(3):
        data = ground.socket.recv(65535)
        sequences.append((data[6], data[4]))
    assert sequences == [(1, 0), (169, 0), (1, 1)]
    channel.close()
