"""Two ground stations at one vehicle, each on a link of its own: the vehicle forwards their HEARTBEATs."""

from __future__ import annotations

from app.vehicles.settings import LinkSettings
from tests.support.driving import opened_link, until
from tests.support.simulated import SimulatedFleet, free_udp_ports

SOON_S = 15.0
FIRST, SECOND = LinkSettings(own_system_id=245), LinkSettings(own_system_id=246)


async def test_each_hears_the_other_on_its_own_link_until_that_one_ends() -> None:
    port = free_udp_ports(2)
    with SimulatedFleet("quad", speed=3.0, port=port, gcs_port=str(port + 1)) as fleet:
        async with opened_link([f"udpin://127.0.0.1:{port + 1}"], settings=SECOND) as second:
            assert second.ground_station_age_s(245) is None, "nobody else is there yet"
            async with opened_link(fleet.connections, settings=FIRST) as first:
                await until(lambda: second.ground_station_age_s(245) is not None, "the second hears the first", SOON_S)
                await until(lambda: first.ground_station_age_s(246) is not None, "the first hears the second", SOON_S)
                await first.hold()
                await second.hold()
                assert second.ground_station_age_s(246) is None, "its own HEARTBEAT is none of another"
            await until(lambda: (second.ground_station_age_s(245) or 0.0) > 3.0, "the first is silent", SOON_S)
            assert second.state().connected, "the vehicle is still heard"
