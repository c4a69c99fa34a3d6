"""Start-up, arming, modes and single commands: scenarios 01, 14, 18, 22 and 25."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RETURN, Cockpit, takeoff, waypoint

LONG = [takeoff(15), waypoint(60, 0, 15), waypoint(60, 60, 15), waypoint(0, 60, 15), RETURN]


def test_a_vehicle_wakes_up_step_by_step() -> None:
    cockpit = Cockpit(ready=False)
    cockpit.fly(6.0)
    first = {name: next(h.t_s for h in cockpit.heard if h.name == name) for name in ("HEARTBEAT", "HOME_POSITION")}
    assert 1.1 <= first["HEARTBEAT"] <= 1.6
    assert 2.2 <= first["HOME_POSITION"] <= 4.3
    standby = next(h.t_s for h in cockpit.heard if h.name == "HEARTBEAT" and h.message.system_status == 3)
    assert 4.6 <= standby <= 5.7


def test_arming_is_denied_at_first() -> None:
    cockpit = Cockpit(ready=False)
    cockpit.fly(3.0)
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    assert "".join(cockpit.texts()) == "Arming denied: Resolve system health failures first"
    cockpit.fly(2.0)
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.ACCEPTED]


def test_a_long_text_comes_in_two_chunks_and_only_where_a_gcs_was_heard() -> None:
    cockpit = Cockpit(ready=False)
    cockpit.fly(3.0)
    cockpit.command(Cmd.COMPONENT_ARM_DISARM, 1)
    chunks = cockpit.messages("STATUSTEXT")
    assert [chunk.chunk_seq for chunk in chunks] == [0, 1]
    assert chunks[0].id == chunks[1].id != 0
    silent = Cockpit(ready=False, heartbeats=False)
    silent.fly(3.0)
    silent.command(Cmd.COMPONENT_ARM_DISARM, 1)
    assert silent.texts() == []


def test_without_a_mission_its_mode_is_taken_but_nothing_starts() -> None:
    cockpit = Cockpit()
    assert cockpit.command(Cmd.MISSION_START) == [Result.DENIED]
    assert cockpit.set_mode(Mode.MISSION) == [Result.ACCEPTED]
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    assert cockpit.command(Cmd.DO_SET_MODE, 1, 4, 77) == [Result.TEMPORARILY_REJECTED]
    assert cockpit.texts()[-1] == "Unsupported auto mode"


def test_a_start_in_the_same_cycle_as_the_upload_is_rejected_and_one_cycle_later_accepted() -> None:
    cockpit = Cockpit()
    cockpit.arm()
    cockpit.upload(LONG)
    assert cockpit.set_mode(Mode.MISSION) == [Result.TEMPORARILY_REJECTED]
    other = Cockpit()
    other.arm()
    other.upload(LONG)
    other.fly(0.04)
    assert other.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_mission_start_arms_as_well() -> None:
    cockpit = Cockpit()
    cockpit.upload(LONG)
    cockpit.fly(0.5)
    assert cockpit.command(Cmd.MISSION_START) == [Result.ACCEPTED]
    assert cockpit.armed


def test_offboard_without_a_stream_is_taken_on_the_ground_but_never_flown() -> None:
    cockpit = Cockpit()
    assert cockpit.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    cockpit.set_mode(Mode.LOITER)
    cockpit.arm()
    assert cockpit.set_mode(Mode.OFFBOARD) == [Result.TEMPORARILY_REJECTED]


def test_armed_without_a_take_off_disarms_after_ten_seconds() -> None:
    cockpit = Cockpit()
    cockpit.arm()
    assert cockpit.until(lambda: not cockpit.armed, 15.0) == pytest.approx(10.0, abs=1.0)
    assert cockpit.texts()[-1] == "Disarmed by auto preflight disarming"


@pytest.mark.parametrize("comes_down", [Mode.LAND, Mode.RTL])
def test_after_a_landing_the_mode_before_it_is_wanted_again(comes_down: Mode) -> None:
    cockpit = Cockpit()
    cockpit.start(LONG)
    cockpit.until(lambda: cockpit.vehicle.state.body.up_m > 5)
    cockpit.set_mode(comes_down)
    cockpit.until(lambda: not cockpit.armed, 120.0)
    assert cockpit.vehicle.state.status.mode is Mode.MISSION


def test_in_the_air_only_a_forced_disarming_works() -> None:
    cockpit = Cockpit()
    cockpit.start(LONG)
    cockpit.until(lambda: cockpit.vehicle.state.body.up_m > 10)
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 0) == [Result.TEMPORARILY_REJECTED]
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196) == [Result.ACCEPTED]
    cockpit.fly(5.0)
    assert cockpit.vehicle.state.body.up_m == 0.0


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
