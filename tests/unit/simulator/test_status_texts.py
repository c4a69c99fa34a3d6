"""Who hears what the vehicle says in words [03_upload_bad, 24_link_loss]."""

from __future__ import annotations

from app.simulator.dialect import mavlink
from app.simulator.wire import Severity
from tests.support.simulated_vehicle import GroundStation, waypoint

OTHER = (246, 191)


def heartbeat(gcs: GroundStation) -> None:
    gcs.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))


def test_a_text_waits_for_a_ground_station_but_not_longer_than_five_seconds() -> None:
    gcs = GroundStation(heartbeats=False)
    gcs.vehicle.radio.text(Severity.INFO, "old")
    gcs.fly(3.0)
    gcs.vehicle.radio.text(Severity.INFO, "new")
    gcs.fly(3.0)
    assert gcs.texts() == []
    heartbeat(gcs)
    assert gcs.texts() == ["new"]


def test_a_ground_station_that_falls_silent_hears_no_more_until_it_is_back() -> None:
    gcs = GroundStation()
    gcs.heartbeats = False
    gcs.vehicle.radio.text(Severity.INFO, "heard at once")
    gcs.fly(4.0)
    gcs.vehicle.radio.text(Severity.INFO, "heard later")
    assert gcs.texts() == ["heard at once"]
    heartbeat(gcs)
    heartbeat(gcs)
    assert gcs.texts() == ["heard at once", "heard later"]


def test_a_second_ground_station_is_refused_without_a_text_amid_an_upload() -> None:
    gcs = GroundStation()
    gcs.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 0, 0))
    gcs.send(gcs.item(0, waypoint(10, 0, 10)))
    gcs.send(mavlink.MAVLink_mission_count_message(1, 1, 2, 0, 0), OTHER)
    assert (gcs.last("MISSION_ACK").type, gcs.last("MISSION_ACK").target_system) == (1, OTHER[0])
    assert gcs.texts() == []
