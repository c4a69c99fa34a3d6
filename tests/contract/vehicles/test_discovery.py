"""LinkSource: every vehicle on every connection is found, known, and let go again."""

from __future__ import annotations

import asyncio
import socket
import threading
import time

import pytest

from app.domain.errors import LinkError, VehicleQuarantinedError
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.vehicle.facts import DuplicateSystem, QuarantineEnded
from app.domain.vehicle.state import VehicleType
from app.vehicles import MavsdkLinkSource
from app.vehicles.native import MAX_INSTANCES
from app.vehicles.settings import LinkSettings
from tests.support.driving import ReceivedFacts, mission, opened, until, uploaded
from tests.support.simulated import SimulatedFleet, free_udp_ports


async def test_vehicles_that_share_one_port_are_found_each_by_its_system_id() -> None:
    with SimulatedFleet("quad,quad,quad:sysid=9", shared_port=True) as fleet:
        async with opened(fleet.connections, vehicles=3) as source:
            assert sorted(link.identity.system_id for link in source.links()) == [1, 2, 9]
            assert {link.identity.connection for link in source.links()} == set(fleet.connections)


async def test_an_upload_on_a_shared_port_reaches_its_vehicle_alone() -> None:
    with SimulatedFleet("quad,quad", shared_port=True) as fleet:
        async with opened(fleet.connections, vehicles=2) as source:
            one, two = sorted(source.links(), key=lambda link: link.identity.system_id)
            steps = await asyncio.gather(uploaded(one, mission(5)), uploaded(two, mission(7)))
            assert [step.total for step in steps] == [5, 7]
            await until(lambda: one.state().mission_total == 5, "vehicle 1 must show its mission", 15.0)
            await until(lambda: two.state().mission_total == 7, "vehicle 2 must show its mission", 15.0)


async def test_vehicles_on_ports_of_their_own_are_found_with_their_connection() -> None:
    with SimulatedFleet("quad,quad") as fleet:
        async with opened(fleet.connections, vehicles=2) as source:
            assert {link.identity.system_id: link.identity.connection for link in source.links()} == {
                1: fleet.connections[0],
                2: fleet.connections[1],
            }


async def test_a_listener_hears_of_each_vehicle_once_and_finds_its_type_known() -> None:
    with SimulatedFleet("quad", speed=5.0) as fleet:
        source = MavsdkLinkSource(fleet.connections)
        found: list[VehicleLink] = []
        types: list[VehicleType | None] = []
        source.subscribe(found.append)
        source.subscribe(lambda link: types.append(link.identity.vehicle_type))
        await source.start()
        try:
            await until(lambda: bool(found), "the vehicle must be found", 15.0)
            await until(lambda: found[0].identity.uid is not None, "its identity must become known", 15.0)
        finally:
            await source.close()
        assert found == list(source.links())
        assert types == [VehicleType.MULTICOPTER]


async def test_identity_tells_firmware_and_uid() -> None:
    with SimulatedFleet("quad", speed=5.0) as fleet:
        async with opened(fleet.connections, vehicles=1) as source:
            link = source.links()[0]
            await until(lambda: link.identity.uid is not None, "AUTOPILOT_VERSION must be asked for", 15.0)
            assert link.identity.firmware is not None
            assert link.identity.firmware.major == 1
            assert int(str(link.identity.uid), 16) > 0


async def test_a_port_that_somebody_else_listens_on_is_an_error_with_a_hint() -> None:
    port = free_udp_ports(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind(("0.0.0.0", port))
        source = MavsdkLinkSource([f"udpin://127.0.0.1:{port}"])
        with pytest.raises(LinkError, match=f"{port}") as caught:
            await source.start()
        assert "another" in caught.value.hint
        await source.close()


@pytest.mark.parametrize(
    "url",
    ["udpin://localhost:25001", "udpin://127.0.0.1", "udp://:25001", "udpin://127.0.0.1:99999", "nonsense", ""],
)
async def test_a_connection_that_cannot_work_is_refused_by_name(url: str) -> None:
    source = MavsdkLinkSource([url])
    with pytest.raises(LinkError) as caught:
        await source.start()
    assert repr(url) in caught.value.detail
    assert "udpin://" in caught.value.hint
    await source.close()


async def test_one_port_named_twice_is_refused() -> None:
    port = free_udp_ports(1)
    source = MavsdkLinkSource([f"udpin://127.0.0.1:{port}", f"udpin://0.0.0.0:{port}"])
    with pytest.raises(LinkError, match="already used"):
        await source.start()


async def test_a_connection_that_fails_leaves_none_open() -> None:
    first = free_udp_ports(1)
    source = MavsdkLinkSource([f"udpin://127.0.0.1:{first}", "serial:///dev/no-such-device:57600"])
    with pytest.raises(LinkError, match="no-such-device"):
        await source.start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", first))


async def test_more_connections_than_mavsdk_carries_are_refused_before_any_is_opened() -> None:
    first = free_udp_ports(MAX_INSTANCES + 1)
    urls = [f"udpin://127.0.0.1:{first + n}" for n in range(MAX_INSTANCES + 1)]
    threads = threading.active_count()
    with pytest.raises(LinkError, match="at most 15"):
        await MavsdkLinkSource(urls).start()
    assert threading.active_count() == threads


async def test_the_instances_of_two_sources_count_together() -> None:
    first = free_udp_ports(MAX_INSTANCES + 1)
    urls = [f"udpin://127.0.0.1:{first + n}" for n in range(MAX_INSTANCES + 1)]
    full, more = MavsdkLinkSource(urls[:MAX_INSTANCES]), MavsdkLinkSource(urls[MAX_INSTANCES:])
    await full.start()
    try:
        with pytest.raises(LinkError, match="at most 15"):
            await more.start()
    finally:
        await full.close()
    await more.start()
    await more.close()


async def test_two_vehicles_with_one_system_id_on_one_open_connection_are_quarantined() -> None:
    with SimulatedFleet("quad:sysid=4,quad:sysid=4", shared_port=True) as fleet:
        async with opened([f"{url}?peer=any" for url in fleet.connections], vehicles=1) as source:
            link = source.links()[0]
            await ReceivedFacts(link).until(DuplicateSystem, 15.0)
            with pytest.raises(VehicleQuarantinedError, match="two vehicles have the system id 4"):
                await link.arm()
            with pytest.raises(VehicleQuarantinedError):
                await uploaded(link, mission(3))


async def _quarantined(source: MavsdkLinkSource) -> tuple[VehicleLink, VehicleLink, DuplicateSystem]:
    """The link seen first, the quarantined one and why. They may be announced in another order than seen."""
    received = {link: ReceivedFacts(link) for link in source.links()}
    told = "one of two with the same system id must be quarantined"
    await until(lambda: any(one.of(DuplicateSystem) for one in received.values()), told, 3.0)
    second = next(link for link, one in received.items() if one.of(DuplicateSystem))
    first = next(link for link in received if link is not second)
    return first, second, received[second].of(DuplicateSystem)[0]


async def test_the_later_one_of_two_connections_with_one_system_id_is_quarantined() -> None:
    with SimulatedFleet("quad:sysid=4,quad:sysid=4") as fleet:
        async with opened(fleet.connections, vehicles=2) as source:
            first, second, fact = await _quarantined(source)
            assert fact.reason.params["also"] == first.identity.connection
            await uploaded(first, mission(3))
            with pytest.raises(VehicleQuarantinedError):
                await second.arm()


async def test_the_later_one_is_commanded_once_the_first_was_silent_for_a_while() -> None:
    one = SimulatedFleet("quad:sysid=4")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", one.port))
        other = SimulatedFleet("quad:sysid=4")
    with one, other:
        fleets = {fleet.connections[0]: fleet for fleet in (one, other)}
        async with opened([*fleets], vehicles=2, settings=LinkSettings(quarantine_s=2.0)) as source:
            first, second, _ = await _quarantined(source)
            received, heard_first = ReceivedFacts(second), ReceivedFacts(first)
            fleets[first.identity.connection].control("link_cut", True)
            await received.until(QuarantineEnded, 20.0)
            await uploaded(second, mission(3))
            fleets[first.identity.connection].control("link_cut", False)
            await heard_first.until(DuplicateSystem, 20.0)
            assert not received.of(DuplicateSystem)[1:], "the one that is in use stays"


async def test_a_listener_that_comes_after_the_quarantine_is_told_too() -> None:
    with SimulatedFleet("quad:sysid=4,quad:sysid=4") as fleet:
        async with opened(fleet.connections, vehicles=2) as source:
            _, second, _ = await _quarantined(source)
            await ReceivedFacts(second).until(DuplicateSystem, 15.0)
            await ReceivedFacts(second).until(DuplicateSystem, 15.0)


async def test_close_ends_soon_and_twice_is_fine() -> None:
    with SimulatedFleet("quad,quad", speed=5.0) as fleet:
        async with opened(fleet.connections, vehicles=2) as source:
            began_s = time.monotonic()
            await source.close()
            assert time.monotonic() - began_s < 15.0
            await source.close()
