"""MISSION_CURRENT and the modes: which mission_state, when, and what counts as mission mode (scenarios 16, 22, 25)."""

from __future__ import annotations

from app.simulator.wire import Cmd, MissionState, Mode
from tests.support.simulated_vehicle import RETURN, Cockpit, land, takeoff, waypoint


def shown(cockpit: Cockpit) -> tuple[int, int]:
    cockpit.fly(1.1)
    current = cockpit.last("MISSION_CURRENT")
    return current.mission_state, current.mission_mode


def test_takeoff_and_land_mode_count_as_mission_modes_when_a_mission_is_stored() -> None:
    cockpit = Cockpit(params={"MIS_TAKEOFF_ALT": 10.0})
    cockpit.upload([takeoff(10), waypoint(20, 0, 10), RETURN])
    cockpit.set_mode(Mode.TAKEOFF)
    cockpit.arm()
    assert shown(cockpit) == (MissionState.ACTIVE, 1)
    cockpit.until(lambda: cockpit.vehicle.state.status.mode is Mode.LOITER, 40.0)
    assert shown(cockpit) == (MissionState.COMPLETE, 2)
    cockpit.command(Cmd.NAV_LAND)
    assert shown(cockpit) == (MissionState.ACTIVE, 1)
    cockpit.until(lambda: cockpit.vehicle.state.status.landed, 60.0)
    assert shown(cockpit)[0] == MissionState.COMPLETE


def test_the_end_of_a_mission_is_told_at_once_and_not_in_the_next_slot() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(4), land()])
    cockpit.until(lambda: cockpit.vehicle.mission.result.finished)
    assert cockpit.last("MISSION_CURRENT").mission_state == MissionState.COMPLETE


def test_everything_about_a_mission_comes_in_slots_of_one_second() -> None:
    cockpit = Cockpit()
    begin_s = cockpit.now_s
    cockpit.fly(10.0)
    assert 9 <= len(cockpit.messages("MISSION_CURRENT", begin_s)) <= 11


def test_a_mission_paused_on_its_first_item_has_not_started() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(20), waypoint(20, 0, 20), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.up_m > 5)
    cockpit.set_mode(Mode.LOITER)
    assert shown(cockpit) == (MissionState.NOT_STARTED, 2)
