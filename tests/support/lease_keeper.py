"""A gateway's lease of its site in a process of its own, which a test kills or suspends.

    python -m tests.support.lease_keeper NATS_URL SITE GATEWAY

prints each state of the lease as it changes.
"""

from __future__ import annotations

import asyncio
import sys

from app.cluster import BusSettings, open_bus
from app.domain.cluster.lease import Leaseholder, LeaseState
from app.services.clock import SystemClock
from app.services.journal import Journal
from app.services.site_lease import SiteLease
from tests.support.fakes import MemoryEventStore
from tests.support.memory_cluster import NoHandover

LOOK_S = 0.02


async def keep(url: str, site: str, gateway: str) -> None:
    """Keep the lease until the process ends."""
    clock = SystemClock()
    journal = Journal(MemoryEventStore(), clock)
    await journal.start()
    said: LeaseState | None = None
    async with open_bus(BusSettings(servers=(url,), name=gateway)) as bus:
        handover = NoHandover()
        handover.silent = True
        me = Leaseholder(gateway=gateway, address=gateway, system_id=245, has_standby=True)
        lease = SiteLease(site, me, journal, bus, clock, handover)
        async with lease.kept():
            while True:
                if (state := lease.claim.state) is not said:
                    said = state
                    sys.stdout.write(f"{state.value}\n")
                    sys.stdout.flush()
                await asyncio.sleep(LOOK_S)


if __name__ == "__main__":
    asyncio.run(keep(*sys.argv[1:]))
