"""MISSION_CURRENT and the modes: which mission_state, when, and what counts as mission mode (scenarios 16, 22, 25)."""

from __future__ import annotations

from app.simulator.wire import Cmd, MissionState, Mode
from tests.support.simulated_vehicle import RETURN, GroundStation, land, takeoff, waypoint


def shown(gcs: GroundStation) -> tuple[int, int]:
    gcs.fly(1.1)
    current = gcs.last("MISSION_CURRENT")
    return current.mission_state, current.mission_mode


def test_takeoff_and_land_mode_count_as_mission_modes_when_a_mission_is_stored() -> None:
    gcs = GroundStation(params={"MIS_TAKEOFF_ALT": 10.0})
    gcs.upload([takeoff(10), waypoint(20, 0, 10), RETURN])
    gcs.set_mode(Mode.TAKEOFF)
    gcs.arm()
    assert shown(gcs) == (MissionState.ACTIVE, 1)
    gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.LOITER, 40.0)
    assert shown(gcs) == (MissionState.COMPLETE, 2)
    gcs.command(Cmd.NAV_LAND)
    assert shown(gcs) == (MissionState.ACTIVE, 1)
    gcs.until(lambda: gcs.vehicle.state.status.landed, 60.0)
    assert shown(gcs)[0] == MissionState.COMPLETE


def test_the_end_of_a_mission_is_told_at_once_and_not_in_the_next_slot() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(4), land()])
    gcs.until(lambda: gcs.vehicle.mission.result.finished)
    assert gcs.last("MISSION_CURRENT").mission_state == MissionState.COMPLETE


def test_everything_about_a_mission_comes_in_slots_of_one_second() -> None:
    gcs = GroundStation()
    begin_s = gcs.now_s
    gcs.fly(10.0)
    assert 9 <= len(gcs.messages("MISSION_CURRENT", begin_s)) <= 11


def test_a_mission_paused_on_its_first_item_has_not_started() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(20), waypoint(20, 0, 20), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 5)
    gcs.set_mode(Mode.LOITER)
    assert shown(gcs) == (MissionState.NOT_STARTED, 2)
