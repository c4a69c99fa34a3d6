"""VehicleLink on a signed link: flown as any other, given its keys, and back after restarts of either side."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from app.domain.errors import ConflictError, LinkTimeoutError, NotFoundError
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.facts import LinkSecured, Rebooted
from app.domain.vehicle.link_security import LinkSecurity, RefusalKind
from app.domain.vehicle.state import FlightMode
from app.vehicles import KeyFile, MavsdkLinkSource, MemoryFile, SigningStore
from tests.support.driving import ReceivedFacts, flying, mission, until, uploaded
from tests.support.guarded_link import UdpEnd
from tests.support.mavlink_frames import FrameSender
from tests.support.simulated import SimulatedFleet, free_udp_ports


class Keys:
    """The key files of one machine, and a source that uses them."""

    def __init__(self, folder: Path) -> None:
        self.file = KeyFile(folder / "link-keys.json")
        self.memory = MemoryFile(folder / "link-state.json")

    @asynccontextmanager
    async def opened(
        self, fleet: SimulatedFleet, vehicles: int = 1, *, before: tuple[str, ...] = (), options: str = ""
    ) -> AsyncIterator[MavsdkLinkSource]:
        """`before`: connections that come before the fleet's. `options`: of the fleet's."""
        urls = [f"{url}{options}" for url in fleet.connections]
        source = MavsdkLinkSource((*before, *urls), signing=SigningStore(self.file, self.memory))
        await source.start()
        try:
            await until(lambda: len(source.links()) >= vehicles, "the vehicle must be found", 15.0)
            yield source
        finally:
            await source.close()


@pytest.fixture
def keys(tmp_path: Path) -> Keys:
    return Keys(tmp_path)


def is_signed(link: VehicleLink) -> bool:
    return link.state().link_security is LinkSecurity.SIGNED


async def given_its_newest_key(source: MavsdkLinkSource, link: VehicleLink) -> str:
    """The key's fingerprint. The key file is looked at once a second: until then there is no newer one."""
    deadline_s = time.monotonic() + 15.0
    while True:
        try:
            return await source.set_up_signing(link.identity.system_id, link.identity.connection)
        except (NotFoundError, ConflictError):
            if time.monotonic() > deadline_s:
                raise
            await asyncio.sleep(0.1)


async def test_a_signed_vehicle_is_uploaded_to_armed_and_flown(keys: Keys) -> None:
    keys.file.add(1)
    with SimulatedFleet(f"quad:key={keys.file.path}", speed=3.0) as fleet:
        async with keys.opened(fleet) as source:
            link = source.links()[0]
            assert is_signed(link)
            await flying(link, mission(5, north_m=30))
            await link.return_to_launch()
            await until(lambda: link.state().mode is FlightMode.RETURN, "it must return", 10.0)


async def test_who_has_no_key_neither_speaks_for_it_nor_commands_it(keys: Keys) -> None:
    keys.file.add(1)
    with SimulatedFleet(f"quad:key={keys.file.path}", speed=3.0) as fleet:
        async with keys.opened(fleet) as source:
            link = source.links()[0]
            forger = UdpEnd(("127.0.0.1", fleet.port))
            liar = FrameSender(1, 1)
            for _ in range(20):
                forger.send(liar.heartbeat(armed=True))
                forger.send(FrameSender(1, 1, key=b"x" * 32).heartbeat(armed=True))
                await asyncio.sleep(0.02)
            refused = {one.kind for one in source.refused()}
            assert {RefusalKind.UNSIGNED, RefusalKind.BAD_SIGNATURE} <= refused
            assert link.state().armed is False
            assert forger.received() == b""
            forger.close()


async def test_a_vehicle_without_a_key_is_given_one_and_then_the_next(keys: Keys) -> None:
    with SimulatedFleet("quad", speed=3.0) as fleet:
        async with keys.opened(fleet) as source:
            link = source.links()[0]
            heard = ReceivedFacts(link)
            await until(lambda: link.identity.uid is not None, "it must be known", 10.0)
            assert link.state().link_security is LinkSecurity.PINNED
            with pytest.raises(NotFoundError, match="no key"):
                await source.set_up_signing(1, link.identity.connection)
            first = keys.file.add(1).key.fingerprint
            await until(lambda: not is_signed(link), "a new key alone changes nothing", 0.1)
            assert await given_its_newest_key(source, link) == first
            assert is_signed(link)
            await heard.until(LinkSecured, 5.0)
            with pytest.raises(ConflictError, match="newest key"):
                await source.set_up_signing(1, link.identity.connection)
            second = keys.file.add(1).key.fingerprint
            assert await given_its_newest_key(source, link) == second
            await uploaded(link, mission(4))


async def test_a_key_goes_to_the_vehicles_own_connection_and_to_no_other(keys: Keys) -> None:
    other, secret = free_udp_ports(2), keys.file.add(1).key.secret
    with SimulatedFleet("quad", speed=3.0, port=other + 1) as fleet:
        async with keys.opened(fleet, before=(f"udpin://127.0.0.1:{other}",)) as source:
            own = source.links()[0].identity.connection
            forger, liar = UdpEnd(("127.0.0.1", other)), FrameSender(1, 1)
            heard: list[bytes] = []

            def is_answered() -> bool:
                forger.send(liar.heartbeat())
                heard.append(forger.received())
                return any(heard)

            await until(is_answered, "it must count as a vehicle there", 15.0)
            assert await source.set_up_signing(1, own)
            heard.append(forger.received())
            assert secret not in b"".join(heard)
            forger.close()


async def test_a_key_is_not_sent_on_an_open_connection(keys: Keys) -> None:
    keys.file.add(1)
    with SimulatedFleet("quad", speed=3.0) as fleet:
        async with keys.opened(fleet, options="?peer=any") as source:
            with pytest.raises(ConflictError, match="every peer"):
                await source.set_up_signing(1, source.links()[0].identity.connection)


async def test_a_vehicle_in_flight_keeps_its_key_and_goes_on_being_heard(keys: Keys) -> None:
    keys.file.add(1)
    with SimulatedFleet("quad", speed=3.0) as fleet:
        async with keys.opened(fleet) as source:
            link = source.links()[0]
            await flying(link, mission(5, north_m=60))
            with pytest.raises(LinkTimeoutError, match="does not sign"):
                await source.set_up_signing(1, link.identity.connection)
            assert link.state().connected
            assert not is_signed(link)


async def test_a_signed_vehicle_that_reboots_is_heard_again(keys: Keys) -> None:
    """Without a clock its timestamps begin anew, until it has heard ours."""
    keys.file.add(1)
    with SimulatedFleet(f"quad:key={keys.file.path}", speed=3.0) as fleet:
        async with keys.opened(fleet) as source:
            link = source.links()[0]
            heard = ReceivedFacts(link)
            await until(lambda: (link.state().boot_time_s or 0.0) > 20.0, "it must have been up for a while", 20.0)
            fleet.control("reboot", True)
            await heard.until(Rebooted, 15.0)
            await until(lambda: link.state().connected, "it must be heard", 5.0)
            await uploaded(link, mission(4))


async def test_after_a_restart_of_the_service_the_vehicle_is_still_required_to_sign(keys: Keys) -> None:
    keys.file.add(1)
    with SimulatedFleet(f"quad:key={keys.file.path}", speed=3.0) as fleet:
        for _ in range(3):
            async with keys.opened(fleet) as source:
                link = source.links()[0]
                assert is_signed(link)
                await uploaded(link, mission(4))
    with SimulatedFleet("quad", speed=3.0) as unsigned:
        source = MavsdkLinkSource(unsigned.connections, signing=SigningStore(keys.file, keys.memory))
        await source.start()
        try:
            await until(
                lambda: any(one.kind is RefusalKind.UNSIGNED for one in source.refused()), "it must be refused", 10.0
            )
            assert not source.links()
        finally:
            await source.close()


async def test_signed_and_unsigned_vehicles_share_a_port(keys: Keys) -> None:
    keys.file.add(1)
    keys.file.add(3)
    entries = f"quad:key={keys.file.path},quad,quad:key={keys.file.path}"
    with SimulatedFleet(entries, speed=3.0, shared_port=True) as fleet:
        async with keys.opened(fleet, vehicles=3) as source:
            links = sorted(source.links(), key=lambda link: link.identity.system_id)
            assert [is_signed(link) for link in links] == [True, False, True]
            await asyncio.gather(*(uploaded(link, mission(4)) for link in links))
