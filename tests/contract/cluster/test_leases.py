"""One gateway at a time has a site, with a real NATS server: its holder is killed, suspended, and stopped in order."""

from __future__ import annotations

import asyncio
import signal
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial

import pytest

from app.cluster import BusSettings, open_bus
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, LeaseMovedError
from app.domain.cluster.ports import Bus, GatewaySite, calls_of
from app.services.clock import SystemClock
from app.services.remote.calls import Caller, CallServer
from app.services.remote.journal import ClusterJournal
from tests.support.memory_cluster import MemoryClusterEvents
from tests.support.paths import ROOT
from tests.support.service_process import until
from tools.cluster_servers import NatsServer

SITE = "north"
KEY = b"k" * 32
SOON_S = 60.0


@asynccontextmanager
async def bus_with_leases(nats: NatsServer) -> AsyncIterator[Bus]:
    """A connection, and the bucket that API nodes make."""
    async with open_bus(BusSettings(servers=(nats.url,), name="test")) as bus, AsyncExitStack() as stack:
        async with asyncio.timeout(SOON_S):
            while True:
                try:
                    await stack.enter_async_context(bus.envelopes())
                    break
                except BusDownError:
                    await asyncio.sleep(0.05)
        yield bus


@asynccontextmanager
async def keeper(nats: NatsServer, gateway: str) -> AsyncIterator[Process]:
    """A process with the lease of SITE, or without it."""
    command = (sys.executable, "-m", "tests.support.lease_keeper", nats.url, SITE, gateway)
    process = await asyncio.create_subprocess_exec(*command, stdout=PIPE, cwd=ROOT)
    try:
        yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()


async def says(process: Process) -> str:
    """The next state of the lease."""
    assert process.stdout is not None
    async with asyncio.timeout(SOON_S):
        line = await process.stdout.readline()
    assert line, "the process must go on"
    return line.decode().strip()


async def says_at_last(process: Process, state: str) -> None:
    """Read on until it says this state."""
    while await says(process) != state:
        pass


async def test_a_lease_is_written_only_after_the_revision_that_was_read(nats: NatsServer) -> None:
    async with bus_with_leases(nats) as bus:
        assert await bus.read_lease(SITE) == (b"", 0)
        first = await bus.write_lease(SITE, b"one", after=0)
        assert await bus.read_lease(SITE) == (b"one", first)
        with pytest.raises(LeaseMovedError):
            await bus.write_lease(SITE, b"other", after=0)
        second = await bus.write_lease(SITE, b"one", after=first)
        with pytest.raises(LeaseMovedError):
            await bus.write_lease(SITE, b"other", after=first)
        given_up = await bus.write_lease(SITE, b"", after=second)
        assert await bus.read_lease(SITE) == (b"", given_up)
        await bus.write_lease(SITE, b"other", after=given_up)
        assert (await bus.read_lease(SITE))[0] == b"other"


class Commands:
    """What a gateway does here."""

    def __init__(self) -> None:
        self.done: list[str] = []

    async def hold(self, vehicle_id: str) -> str:
        self.done.append(vehicle_id)
        return vehicle_id


async def test_of_two_gateways_that_believe_they_have_a_vehicle_one_carries_a_command_out(nats: NatsServer) -> None:
    clock, commands = SystemClock(), {"one": Commands(), "other": Commands()}
    async with AsyncExitStack() as stack:
        for address, done in commands.items():
            bus = await stack.enter_async_context(open_bus(BusSettings(servers=(nats.url,), name=address)))
            part = GatewaySite(gateway="gw-1", site=SITE, address=address)
            server = CallServer(part, {"hold": done.hold}, KEY, lambda: 0, clock)
            await stack.enter_async_context(bus.answering(calls_of(SITE), server.answer))
            await stack.enter_async_context(bus.answering(f"waydrop.test.{address}", server.answer))
        node = await stack.enter_async_context(bus_with_leases(nats))
        for address in commands:
            await until(partial(is_there, node, address), bool, "both must answer", SOON_S)
        caller = Caller(node, KEY, ClusterJournal(MemoryClusterEvents(), clock).reached, clock)
        for number in range(20):
            answer = await caller.call(calls_of(SITE), SITE, "hold", str, "other", vehicle_id=f"north-v{number}")
            assert answer == f"north-v{number}"
    assert commands["one"].done == []
    assert commands["other"].done == [f"north-v{number}" for number in range(20)]


async def is_there(bus: Bus, address: str) -> bool:
    """Whether its subscriptions have reached the server: the later one is of the same connection."""
    try:
        await bus.request(f"waydrop.test.{address}", b"", timeout_s=SOON_S)
    except GatewayUnreachableError:
        return False
    return True


async def test_a_lease_passes_on_when_its_holder_is_killed_or_suspended_and_the_suspended_one_learns_that(
    nats: NatsServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.cluster.nats_bus.LEASE_TTL_S", 10.0)  # of the bucket: a busy machine may stand still for 5
    async with bus_with_leases(nats), keeper(nats, "gw-1") as first:
        await says_at_last(first, "held")
        async with keeper(nats, "gw-2") as second:
            await says_at_last(second, "taken")
            first.kill()
            await says_at_last(second, "held")
            async with keeper(nats, "gw-3") as third:
                await says_at_last(third, "taken")
                second.send_signal(signal.SIGSTOP)
                await says_at_last(third, "held")
                second.send_signal(signal.SIGCONT)
                await says_at_last(second, "taken")
