"""A report of a moving target is told to all nodes and gateways once."""

from __future__ import annotations

import asyncio
import time
from contextlib import AsyncExitStack, suppress

from app.cluster import BusSettings, open_bus
from app.domain.cluster.errors import BusDownError
from app.domain.cluster.ports import Bus
from app.domain.targets import TargetReport
from app.services.clock import SystemClock
from app.services.remote.targets import TARGETS_SUBJECT, SharedReports, SharedTargets
from app.services.targets import Targets
from tests.support.service_process import until
from tools.cluster_servers import NatsServer

SOON_S = 60.0
MARK = b"mark"


def report_at(time_s: float) -> TargetReport:
    return TargetReport(time=time_s, latitude_deg=47.0, longitude_deg=8.0, north_m_s=0.0, east_m_s=0.0)


async def heard_of(bus: Bus, mark: bytes, told: list[bytes]) -> bool:
    """Whether a mark of this bus was heard; it is sent again each time, because nobody may have been subscribed yet."""
    with suppress(BusDownError):
        await bus.publish(TARGETS_SUBJECT, mark)
    return mark in told


async def test_a_report_reaches_everybody_in_one_message(nats: NatsServer) -> None:
    """Nodes that tell again what they were told send thousands of messages a second, for ever."""
    told: list[bytes] = []
    gateway = Targets(SystemClock())
    async with AsyncExitStack() as stack:
        buses = [await stack.enter_async_context(open_bus(BusSettings(servers=(nats.url,), name="x"))) for _ in "abc"]
        nodes = [SharedTargets(SystemClock(), bus) for bus in buses[:2]]
        for bus, node in zip(buses, nodes, strict=False):
            await stack.enter_async_context(
                bus.hearing(TARGETS_SUBJECT, SharedReports(node.report, SystemClock()).hear)
            )
        heard = SharedReports(gateway.report, SystemClock())
        await stack.enter_async_context(buses[2].hearing(TARGETS_SUBJECT, heard.hear))
        await stack.enter_async_context(buses[2].hearing(TARGETS_SUBJECT, told.append))
        for number, bus in enumerate(buses):  # subscribed to in the order above
            await until(lambda n=number, bus=bus: heard_of(bus, b"%d" % n, told), bool, "it is heard", SOON_S)  # type: ignore[misc]
        for number, bus in enumerate(buses):
            last = b"last of %d" % number  # behind all that this bus has sent, of which some is still under way
            await bus.publish(TARGETS_SUBJECT, last)
            await until(lambda: asyncio.sleep(0, told), lambda found, last=last: last in found, "all is heard", SOON_S)  # type: ignore[misc]
        told.clear()
        now_s = time.time()
        for number, node in enumerate((*nodes, *nodes)):
            newest = report_at(now_s - 10.0 + number)
            await node.accept("boat", newest)
            for other in (*nodes, gateway):
                await until(
                    lambda other=other: asyncio.sleep(0, [fix.report for fix in other.all()]),  # type: ignore[misc]
                    lambda found, newest=newest: found == [newest],  # type: ignore[misc]
                    "everybody must know the newest report",
                    SOON_S,
                )
        for bus in buses:  # behind what each has sent
            await bus.publish(TARGETS_SUBJECT, MARK)
        await until(lambda: asyncio.sleep(0, told.count(MARK)), lambda found: found == 3, "all is heard", SOON_S)
        assert len(told) == 4 + 3, "a report is told once"
