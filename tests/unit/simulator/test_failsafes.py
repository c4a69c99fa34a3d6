"""What a vehicle does when something fails under way: scenarios 23 and 24."""

from __future__ import annotations

import pytest

from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RETURN, GroundStation, takeoff, waypoint

LONG = [takeoff(15), waypoint(60, 0, 15), waypoint(60, 60, 15), waypoint(0, 60, 15), RETURN]


def test_a_lost_ground_station_leads_to_hold_and_then_return_and_its_return_resumes_nothing() -> None:
    gcs = GroundStation(params={"NAV_DLL_ACT": 2})
    gcs.start([takeoff(15), waypoint(250, 0, 15), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 15)
    gcs.heartbeats = False
    lost_s = gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.LOITER, 20.0)
    assert lost_s == pytest.approx(12.4, abs=1.0)
    assert gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.RTL, 10.0) == pytest.approx(5.0, abs=0.1)
    gcs.fly(1.1)
    assert gcs.last("HEARTBEAT").system_status == 5
    gcs.heartbeats = True
    gcs.fly(3.0)
    assert "GCS connection regained" in gcs.texts()
    assert gcs.vehicle.state.status.mode is Mode.RTL
    assert gcs.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_with_the_failsafe_on_arming_needs_a_ground_station() -> None:
    gcs = GroundStation(params={"NAV_DLL_ACT": 2}, heartbeats=False)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    gcs.heartbeats = True
    gcs.fly(1.0)
    gcs.arm()


def test_by_default_a_lost_ground_station_changes_nothing() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(15), waypoint(250, 0, 15), RETURN])
    gcs.heartbeats = False
    gcs.fly(40.0)
    assert gcs.vehicle.state.status.mode is Mode.MISSION


def test_a_reboot_keeps_the_mission_and_begins_at_item_0_disarmed() -> None:
    gcs = GroundStation()
    gcs.start(LONG)
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    mission_id = gcs.last("MISSION_CURRENT").mission_id
    assert gcs.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 1, wait_s=0.0) == []
    gcs.fly(0.3)
    assert gcs.vehicle.clock.now_s < 0.5
    gcs.fly(1.2)
    assert gcs.last("MISSION_CURRENT").mission_state == 1
    gcs.fly(4.0)
    current = gcs.last("MISSION_CURRENT")
    assert (current.mission_id, current.seq, current.mission_state) == (mission_id, 0, 2)
    assert gcs.last("HEARTBEAT").base_mode & 128 == 0
    gcs.arm()
    assert gcs.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_a_critical_battery_returns_when_the_parameter_says_so() -> None:
    gcs = GroundStation(params={"COM_LOW_BAT_ACT": 3})
    gcs.start([takeoff(15), waypoint(250, 0, 15), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 10)
    gcs.vehicle.battery.set_fraction(0.06)
    assert gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.RTL, 10.0) == pytest.approx(5.0, abs=0.1)
    assert "Critical battery level" in gcs.texts()
    assert gcs.last("SYS_STATUS").battery_remaining in (5, 6)


def test_somebody_elses_mode_stays_until_somebody_changes_it() -> None:
    gcs = GroundStation()
    gcs.start(LONG)
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 15)
    gcs.vehicle.commander.change_mode(Mode.POSCTL)
    gcs.fly(8.0)
    assert gcs.last("HEARTBEAT").custom_mode == Mode.POSCTL
    assert gcs.vehicle.state.body.ground_speed_m_s < 0.5
