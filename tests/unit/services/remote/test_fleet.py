"""An API node shows one gateway of a site, and calls that one."""

from __future__ import annotations

from app.services.remote.fleet import RemoteFleet, SiteReport
from tests.support.fakes import ManualClock


def report(gateway: str, address: str, url: str) -> bytes:
    told = SiteReport(gateway=gateway, site="north", seq=1, url=url, address=address, vehicles=())
    return told.model_dump_json().encode()


def test_a_second_gateway_of_a_site_is_not_heard_until_the_first_one_is_silent() -> None:
    clock = ManualClock()
    fleet = RemoteFleet(clock)
    fleet.hear(report("gw-1", "here", "http://first"))
    for other in (report("gw-2", "elsewhere", "http://other"), report("gw-1", "elsewhere", "http://copy")):
        fleet.hear(other)
        assert fleet.url_of("north-v1") == "http://first"
    fleet.hear(report("gw-1", "here", "http://moved"))
    assert fleet.url_of("north-v1") == "http://moved"
    clock.time_s += 3.1
    fleet.hear(report("gw-2", "elsewhere", "http://other"))
    assert fleet.url_of("north-v1") == "http://other"
