"""Modes, arming, progress and landing states on the wire: scenarios 01, 06, 09, 15, 16, 22 to 25."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, LandedState, Mode, Result
from tests.unit.simulator.cockpit import RELEASE, RETURN, Cockpit, Plan, do, land, takeoff, waypoint

GROUND, AIR, UP, DOWN = LandedState.ON_GROUND, LandedState.IN_AIR, LandedState.TAKEOFF, LandedState.LANDING
LANDING_DETECTED, DISARMED_BY, MISSION_EXECUTE = 26622124, 32794487, 32375217
"""EVENT ids."""
LONG = [takeoff(15), waypoint(60, 0, 15), waypoint(60, 60, 15), waypoint(0, 60, 15), RETURN]


def event_s(cockpit: Cockpit, event_id: int) -> float:
    """When the event came first."""
    return next(h.t_s for h in cockpit.heard if h.name == "EVENT" and h.message.id == event_id)


def seqs(cockpit: Cockpit) -> list[int]:
    return [seq for (seq,) in cockpit.changes("MISSION_CURRENT", "seq")]


def landed_states(cockpit: Cockpit) -> list[int]:
    return [state for (state,) in cockpit.changes("EXTENDED_SYS_STATE", "landed_state")]


def set_current(cockpit: Cockpit, seq: int) -> None:
    cockpit.send(mavlink.MAVLink_mission_set_current_message(1, 1, seq))


# start-up ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def flown() -> Cockpit:
    """Scenario 06, once."""
    cockpit = Cockpit()
    cockpit.start([takeoff(15), waypoint(60, 0, 15), RELEASE, waypoint(60, 45, 15), RETURN])
    cockpit.until(lambda: not cockpit.armed)
    cockpit.fly(3.0)
    return cockpit


def test_set_current_acts_in_flight_and_224_while_holding_waits_for_the_resumption() -> None:
    cockpit = Cockpit()
    cockpit.start(LONG)
    cockpit.until(lambda: cockpit.vehicle.state.body.east_m > 11)
    set_current(cockpit, 1)
    cockpit.fly(1.1)
    assert cockpit.last("MISSION_CURRENT").seq == 1
    cockpit.set_mode(Mode.LOITER)
    assert cockpit.command(Cmd.DO_SET_MISSION_CURRENT, 3) == [Result.ACCEPTED]
    cockpit.fly(2.0)
    assert cockpit.last("MISSION_CURRENT").seq == 1
    cockpit.set_mode(Mode.MISSION)
    cockpit.fly(1.1)
    assert cockpit.last("MISSION_CURRENT").seq == 3


def test_a_supervised_drop_moves_on_by_set_current_without_a_reached() -> None:
    """Scenario 08."""
    cockpit = Cockpit(params={"PD_GRIPPER_TO": 2.0})
    cockpit.start([takeoff(15), waypoint(60, 0, 15, 30, 1), waypoint(60, 45, 15), RETURN])
    cockpit.until(lambda: cockpit.distance_to(60, 0) < 1.5 and cockpit.vehicle.state.body.ground_speed_m_s < 0.3)
    assert cockpit.command(Cmd.DO_GRIPPER, 1, 0, wait_s=2.5) == [Result.IN_PROGRESS, Result.ACCEPTED]
    set_current(cockpit, 2)
    cockpit.fly(1.1)
    assert cockpit.last("MISSION_CURRENT").seq == 2
    assert 1 not in [m.seq for m in cockpit.messages("MISSION_ITEM_REACHED")]


def test_an_upload_in_flight_is_flown_at_once() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 40)
    assert cockpit.upload([waypoint(0, 60, 25), waypoint(60, 60, 25), RETURN]) == 0
    new_id = cockpit.last("MISSION_ACK").opaque_id
    cockpit.fly(1.1)
    current = cockpit.last("MISSION_CURRENT")
    assert (current.mission_id, current.seq, current.mission_state) == (new_id, 0, 3)
    cockpit.until(lambda: cockpit.distance_to(0, 60) < 11, 40.0)
    assert cockpit.last("HEARTBEAT").custom_mode == Mode.MISSION


def test_an_infeasible_upload_in_flight_loses_the_old_mission() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 40)
    assert cockpit.upload([waypoint(60, 0, 20), takeoff(20), RETURN]) == 0, "acknowledged all the same"
    cockpit.fly(1.1)
    assert cockpit.last("MISSION_CURRENT").mission_state == 1
    assert "No valid mission available, loitering" in cockpit.texts()
    assert cockpit.last("HEARTBEAT").custom_mode == Mode.LOITER
    assert cockpit.set_mode(Mode.MISSION) == [Result.TEMPORARILY_REJECTED]
    assert cockpit.upload([waypoint(60, 0, 20), RETURN]) == 0
    cockpit.fly(3.0)
    assert cockpit.last("HEARTBEAT").custom_mode == Mode.LOITER, "it does not resume by itself"
    assert cockpit.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_a_bad_item_in_flight_leaves_the_old_mission_flying() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 40)
    cockpit.upload([waypoint(60, 0, 20), Plan(16, 10, 0, 15, frame=8)])
    cockpit.fly(3.0)
    assert cockpit.vehicle.state.body.north_m > 50
    assert len(cockpit.vehicle.store.mission) == 3


def test_a_takeoff_item_uploaded_in_the_air_is_a_waypoint() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 60)
    cockpit.upload([takeoff(20), waypoint(150, 0, 20), RETURN])
    cockpit.until(lambda: cockpit.distance_to(0, 0) < 11, 60.0)


def test_reposition_takes_every_altitude_as_above_mean_sea_level() -> None:
    cockpit = Cockpit()
    amsl = cockpit.vehicle.spec.frame.altitude_m
    assert cockpit.command(Cmd.NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, amsl + 10) == [Result.ACCEPTED]
    cockpit.arm()
    cockpit.until(lambda: cockpit.vehicle.state.status.mode is Mode.LOITER, 40.0)
    assert cockpit.vehicle.state.body.up_m == pytest.approx(10, abs=1.0)
    latitude, longitude = cockpit.vehicle.spec.frame.to_global(30, 0)
    x, y = round(latitude * 1e7), round(longitude * 1e7)
    cockpit.send(mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, 0, 0, x, y, amsl + 15))
    cockpit.fly(14.0)
    assert cockpit.distance_to(30, 0) < 1.5
    assert cockpit.vehicle.state.body.up_m == pytest.approx(15, abs=1.0)
    cockpit.send(mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, 0, 0, x, y, 12))
    cockpit.fly(5.0)
    assert cockpit.vehicle.state.body.up_m < 10.0, "12 m above the sea is far below ground"


def test_change_speed_and_land_mode() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(15), waypoint(150, 0, 15), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 30)
    assert cockpit.command(Cmd.DO_CHANGE_SPEED, 1, 2, -1) == [Result.ACCEPTED]
    cockpit.fly(4.0)
    assert cockpit.vehicle.state.body.ground_speed_m_s == pytest.approx(2.0, abs=0.4)
    assert cockpit.command(Cmd.NAV_LAND) == [Result.ACCEPTED]
    cockpit.until(lambda: not cockpit.armed, 60.0)
    assert cockpit.last("HEARTBEAT").custom_mode in (Mode.LAND, Mode.LOITER)


def test_armed_without_a_take_off_disarms_after_ten_seconds() -> None:
    cockpit = Cockpit()
    cockpit.arm()
    assert cockpit.until(lambda: not cockpit.armed, 15.0) == pytest.approx(10.0, abs=1.0)
    assert cockpit.texts()[-1] == "Disarmed by auto preflight disarming"


def test_in_the_air_only_a_forced_disarming_works() -> None:
    cockpit = Cockpit()
    cockpit.start(LONG)
    cockpit.until(lambda: cockpit.vehicle.state.body.up_m > 10)
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 0) == [Result.TEMPORARILY_REJECTED]
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196) == [Result.ACCEPTED]
    cockpit.fly(5.0)
    assert cockpit.vehicle.state.body.up_m == 0.0


def test_a_rover_is_in_the_air_half_a_second_after_arming_and_lands_by_disarming() -> None:
    cockpit = Cockpit("rover")
    cockpit.arm()
    cockpit.fly(1.0)
    assert landed_states(cockpit) == [GROUND, AIR]
    cockpit.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196)
    cockpit.fly(0.5)
    assert landed_states(cockpit) == [GROUND, AIR, GROUND]


def test_a_plane_shows_takeoff_on_the_runway_and_landing_with_the_land_item() -> None:
    cockpit = Cockpit("plane")
    cockpit.start([takeoff(40, 160, 15), waypoint(300, 100, 40), do(Cmd.DO_LAND_START),
                   Plan(Cmd.NAV_LOITER_TO_ALT, 80, 300, 20, (1, 60, 0, 1)), land()])  # fmt: skip
    cockpit.until(lambda: not cockpit.armed, 250.0)
    cockpit.fly(1.0)
    assert landed_states(cockpit) == [GROUND, UP, AIR, DOWN, GROUND]
    assert cockpit.last("HEARTBEAT").custom_mode == Mode.MISSION


def test_a_lost_ground_station_leads_to_hold_and_then_return_and_its_return_resumes_nothing() -> None:
    cockpit = Cockpit(params={"NAV_DLL_ACT": 2})
    cockpit.start([takeoff(15), waypoint(250, 0, 15), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 15)
    cockpit.heartbeats = False
    lost_s = cockpit.until(lambda: cockpit.vehicle.state.status.mode is Mode.LOITER, 20.0)
    assert lost_s == pytest.approx(12.4, abs=1.0)
    assert cockpit.until(lambda: cockpit.vehicle.state.status.mode is Mode.RTL, 10.0) == pytest.approx(5.0, abs=0.1)
    cockpit.fly(1.1)
    assert cockpit.last("HEARTBEAT").system_status == 5
    cockpit.heartbeats = True
    cockpit.fly(3.0)
    assert "GCS connection regained" in cockpit.texts()
    assert cockpit.vehicle.state.status.mode is Mode.RTL
    assert cockpit.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_with_the_failsafe_on_arming_needs_a_ground_station() -> None:
    cockpit = Cockpit(params={"NAV_DLL_ACT": 2}, heartbeats=False)
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    cockpit.heartbeats = True
    cockpit.fly(1.0)
    cockpit.arm()


def test_by_default_a_lost_ground_station_changes_nothing() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(15), waypoint(250, 0, 15), RETURN])
    cockpit.heartbeats = False
    cockpit.fly(40.0)
    assert cockpit.vehicle.state.status.mode is Mode.MISSION


def test_a_reboot_keeps_the_mission_and_begins_at_item_0_disarmed() -> None:
    cockpit = Cockpit()
    cockpit.start(LONG)
    cockpit.until(lambda: cockpit.vehicle.store.current_seq == 2)
    mission_id = cockpit.last("MISSION_CURRENT").mission_id
    assert cockpit.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 1, wait_s=0.0) == []
    cockpit.fly(0.3)
    assert cockpit.vehicle.clock.now_s < 0.5
    cockpit.fly(1.2)
    assert cockpit.last("MISSION_CURRENT").mission_state == 1
    cockpit.fly(4.0)
    current = cockpit.last("MISSION_CURRENT")
    assert (current.mission_id, current.seq, current.mission_state) == (mission_id, 0, 2)
    assert cockpit.last("HEARTBEAT").base_mode & 128 == 0
    cockpit.arm()
    assert cockpit.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_a_critical_battery_returns_when_the_parameter_says_so() -> None:
    cockpit = Cockpit(params={"COM_LOW_BAT_ACT": 3})
    cockpit.start([takeoff(15), waypoint(250, 0, 15), RETURN])
    cockpit.until(lambda: cockpit.vehicle.state.body.up_m > 10)
    cockpit.vehicle.battery.set_fraction(0.06)
    cockpit.fly(2.0)
    assert cockpit.vehicle.state.status.mode is Mode.RTL
    assert "Critical battery level" in cockpit.texts()
    assert cockpit.last("SYS_STATUS").battery_remaining in (5, 6)


def test_somebody_elses_mode_stays_until_somebody_changes_it() -> None:
    cockpit = Cockpit()
    cockpit.start(LONG)
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 15)
    cockpit.vehicle.commander.change_mode(Mode.POSCTL)
    cockpit.fly(8.0)
    assert cockpit.last("HEARTBEAT").custom_mode == Mode.POSCTL
    assert cockpit.vehicle.state.body.ground_speed_m_s < 0.5
