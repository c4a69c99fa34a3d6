"""Who hears what the vehicle says in words [03_upload_bad, 24_link_loss]."""

from __future__ import annotations

from app.simulator.dialect import mavlink
from app.simulator.wire import Severity
from tests.support.simulated_vehicle import Cockpit, waypoint

OTHER = (246, 191)


def heartbeat(cockpit: Cockpit) -> None:
    cockpit.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))


def test_a_text_waits_for_a_ground_station_but_not_longer_than_five_seconds() -> None:
    cockpit = Cockpit(heartbeats=False)
    cockpit.vehicle.radio.text(Severity.INFO, "old")
    cockpit.fly(3.0)
    cockpit.vehicle.radio.text(Severity.INFO, "new")
    cockpit.fly(3.0)
    assert cockpit.texts() == []
    heartbeat(cockpit)
    assert cockpit.texts() == ["new"]


def test_a_ground_station_that_falls_silent_hears_no_more_until_it_is_back() -> None:
    cockpit = Cockpit()
    cockpit.heartbeats = False
    cockpit.vehicle.radio.text(Severity.INFO, "heard at once")
    cockpit.fly(4.0)
    cockpit.vehicle.radio.text(Severity.INFO, "heard later")
    assert cockpit.texts() == ["heard at once"]
    heartbeat(cockpit)
    heartbeat(cockpit)
    assert cockpit.texts() == ["heard at once", "heard later"]


def test_a_second_ground_station_is_refused_without_a_text_amid_an_upload() -> None:
    cockpit = Cockpit()
    cockpit.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 0, 0))
    cockpit.send(cockpit.item(0, waypoint(10, 0, 10)))
    cockpit.send(mavlink.MAVLink_mission_count_message(1, 1, 2, 0, 0), OTHER)
    assert (cockpit.last("MISSION_ACK").type, cockpit.last("MISSION_ACK").target_system) == (1, OTHER[0])
    assert cockpit.texts() == []
