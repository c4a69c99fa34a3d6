"""An API node shows one gateway of a site, and calls that one."""

from __future__ import annotations

import pytest

from app.domain.errors import NotFoundError
from app.domain.vehicle.state import VehicleState
from app.services.remote.fleet import MISSED_S, RemoteFleet, SiteReport
from app.services.views import SiteStatus, StateView, VehicleView
from tests.support.fakes import ManualClock


def report(gateway: str, address: str, url: str) -> bytes:
    told = SiteReport(gateway=gateway, site="north", seq=1, url=url, address=address, vehicles=())
    return told.model_dump_json().encode()


def test_a_second_gateway_of_a_site_is_not_heard_until_the_first_one_is_silent() -> None:
    clock = ManualClock()
    fleet = RemoteFleet(clock)
    fleet.receive(report("gw-1", "here", "http://first"))
    for other in (report("gw-2", "elsewhere", "http://other"), report("gw-1", "elsewhere", "http://copy")):
        fleet.receive(other)
        assert fleet.url_of("north-v1") == "http://first"
    fleet.receive(report("gw-1", "here", "http://moved"))
    assert fleet.url_of("north-v1") == "http://moved"
    clock.time_s += 3.1
    fleet.receive(report("gw-2", "elsewhere", "http://other"))
    assert fleet.url_of("north-v1") == "http://other"


def test_a_vehicle_of_a_site_that_nobody_has_is_unknown_and_not_elsewhere() -> None:
    fleet = RemoteFleet(ManualClock())
    fleet.receive(report("gw-1", "here", ""))
    assert fleet.url_of("north-v9") == ""
    with pytest.raises(NotFoundError, match="no vehicle 'nowhere-v1'"):
        fleet.url_of("nowhere-v1")


def vehicle() -> VehicleView:
    return VehicleView(
        id="north-v1",
        system_id=1,
        vehicle_type=None,
        firmware=None,
        uid=None,
        connection="",
        quarantined=None,
        run_id=None,
        performance=None,
        state=StateView.of(VehicleState(connected=True, heartbeat_age_s=0.5)),
    )


def test_a_site_is_told_with_its_gateway_its_vehicles_and_whether_it_reports() -> None:
    clock = ManualClock()
    fleet = RemoteFleet(clock)
    assert fleet.site_statuses() == []
    told = SiteReport(gateway="gw-1", site="north", seq=7, url="http://first", vehicles=(vehicle(),))
    fleet.receive(told.model_dump_json().encode())
    clock.time_s += 10.0
    south = SiteReport(gateway="gw-2", site="south", seq=1, url="", vehicles=())
    fleet.receive(south.model_dump_json().encode())
    assert fleet.site_statuses() == [
        SiteStatus(
            site="north",
            gateway="gw-1",
            url="http://first",
            connected=False,
            report_age_s=10.0,
            seq=7,
            vehicle_ids=("north-v1",),
        ),
        SiteStatus(site="south", gateway="gw-2", url="", connected=True, report_age_s=0.0, seq=1, vehicle_ids=()),
    ]


def test_the_vehicles_of_a_silent_site_are_not_connected_and_what_is_known_of_them_grows_older() -> None:
    clock = ManualClock()
    fleet = RemoteFleet(clock)
    view = vehicle()
    told = SiteReport(gateway="gw-1", site="north", seq=1, url="", vehicles=(view,))
    fleet.receive(told.model_dump_json().encode())
    assert fleet.view("north-v1") == view
    clock.time_s += 10.0
    state = fleet.view("north-v1").state
    assert (state.connected, state.heartbeat_age_s, state.position_age_s) == (False, 10.5, None)


def test_a_site_whose_vehicles_cannot_be_read_any_more_is_shown_as_one_that_is_silent() -> None:
    clock = ManualClock()
    fleet = RemoteFleet(clock)
    told = SiteReport(gateway="gw-1", site="north", seq=1, url="", vehicles=(vehicle(),)).model_dump_json().encode()
    fleet.receive(told)
    for _ in range(4):
        assert fleet.view("north-v1").state.connected
        clock.time_s += 1.0
        fleet.receive(told.replace(b'"connected":true', b'"connected":"who knows"'))
    assert not fleet.view("north-v1").state.connected, "what is shown as connected would never change again"
    fleet.receive(told)
    assert fleet.view("north-v1").state.connected


def test_a_vehicle_that_its_gateway_does_not_report_any_more_is_shown_for_a_while() -> None:
    """A gateway that starts again has heard none of its vehicles yet, which may be in flight."""
    clock = ManualClock()
    fleet = RemoteFleet(clock)
    told = SiteReport(gateway="gw-1", site="north", seq=1, url="", vehicles=(vehicle(),)).model_dump_json().encode()
    fleet.receive(told)
    assert fleet.view("north-v1").state.connected
    for _ in range(2):
        clock.time_s += 2.0
        fleet.receive(report("gw-1", "", ""))
        (shown,) = fleet.vehicles()
    assert (shown.state.connected, shown.state.heartbeat_age_s) == (False, 4.5)
    fleet.receive(told)
    assert fleet.view("north-v1") == vehicle()
    clock.time_s += MISSED_S
    fleet.receive(report("gw-1", "", ""))
    assert fleet.vehicles() == []
    with pytest.raises(NotFoundError):
        fleet.view("north-v1")
