"""Start-up, arming, modes and single commands: scenarios 01, 14, 18, 22 and 25."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RETURN, GroundStation, takeoff, waypoint

LONG = [takeoff(15), waypoint(60, 0, 15), waypoint(60, 60, 15), waypoint(0, 60, 15), RETURN]


def test_a_vehicle_wakes_up_step_by_step() -> None:
    gcs = GroundStation(ready=False)
    gcs.fly(6.0)
    first = {name: next(h.t_s for h in gcs.received if h.name == name) for name in ("HEARTBEAT", "HOME_POSITION")}
    assert 1.1 <= first["HEARTBEAT"] <= 1.6
    assert 2.2 <= first["HOME_POSITION"] <= 4.3
    standby = next(h.t_s for h in gcs.received if h.name == "HEARTBEAT" and h.message.system_status == 3)
    assert 4.6 <= standby <= 5.7


def test_arming_is_denied_at_first() -> None:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    assert "".join(gcs.texts()) == "Arming denied: Resolve system health failures first"
    gcs.fly(2.0)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.ACCEPTED]


def test_a_long_text_comes_in_two_chunks_and_only_where_a_gcs_was_heard() -> None:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    gcs.command(Cmd.COMPONENT_ARM_DISARM, 1)
    chunks = gcs.messages("STATUSTEXT")
    assert [chunk.chunk_seq for chunk in chunks] == [0, 1]
    assert chunks[0].id == chunks[1].id != 0
    silent = GroundStation(ready=False, heartbeats=False)
    silent.fly(3.0)
    silent.command(Cmd.COMPONENT_ARM_DISARM, 1)
    assert silent.texts() == []


def test_without_a_mission_its_mode_is_taken_but_nothing_starts() -> None:
    gcs = GroundStation()
    assert gcs.command(Cmd.MISSION_START) == [Result.DENIED]
    assert gcs.set_mode(Mode.MISSION) == [Result.ACCEPTED]
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    assert gcs.command(Cmd.DO_SET_MODE, 1, 4, 77) == [Result.TEMPORARILY_REJECTED]
    assert gcs.texts()[-1] == "Unsupported auto mode"


def test_a_start_in_the_same_cycle_as_the_upload_is_rejected_and_one_cycle_later_accepted() -> None:
    gcs = GroundStation()
    gcs.arm()
    gcs.upload(LONG)
    assert gcs.set_mode(Mode.MISSION) == [Result.TEMPORARILY_REJECTED]
    other = GroundStation()
    other.arm()
    other.upload(LONG)
    other.fly(0.04)
    assert other.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_mission_start_arms_as_well() -> None:
    gcs = GroundStation()
    gcs.upload(LONG)
    gcs.fly(0.5)
    assert gcs.command(Cmd.MISSION_START) == [Result.ACCEPTED]
    assert gcs.armed


def test_offboard_without_a_stream_is_taken_on_the_ground_but_never_flown() -> None:
    gcs = GroundStation()
    assert gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    gcs.set_mode(Mode.LOITER)
    gcs.arm()
    assert gcs.set_mode(Mode.OFFBOARD) == [Result.TEMPORARILY_REJECTED]


def test_armed_without_a_take_off_disarms_after_ten_seconds() -> None:
    gcs = GroundStation()
    gcs.arm()
    assert gcs.until(lambda: not gcs.armed, 15.0) == pytest.approx(10.0, abs=1.0)
    assert gcs.texts()[-1] == "Disarmed by auto preflight disarming"


@pytest.mark.parametrize("comes_down", [Mode.LAND, Mode.RTL])
def test_after_a_landing_the_mode_before_it_is_wanted_again(comes_down: Mode) -> None:
    gcs = GroundStation()
    gcs.start(LONG)
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 5)
    gcs.set_mode(comes_down)
    gcs.until(lambda: not gcs.armed, 120.0)
    assert gcs.vehicle.state.status.mode is Mode.MISSION


def test_in_the_air_only_a_forced_disarming_works() -> None:
    gcs = GroundStation()
    gcs.start(LONG)
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 10)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 0) == [Result.TEMPORARILY_REJECTED]
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196) == [Result.ACCEPTED]
    gcs.fly(5.0)
    assert gcs.vehicle.state.body.up_m == 0.0


def test_reposition_takes_every_altitude_as_above_mean_sea_level() -> None:
    gcs = GroundStation()
    amsl = gcs.vehicle.spec.frame.altitude_m
    assert gcs.command(Cmd.NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, amsl + 10) == [Result.ACCEPTED]
    gcs.arm()
    gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.LOITER, 40.0)
    assert gcs.vehicle.state.body.up_m == pytest.approx(10, abs=1.0)
    latitude, longitude = gcs.vehicle.spec.frame.to_global(30, 0)
    x, y = round(latitude * 1e7), round(longitude * 1e7)
    gcs.send(mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, 0, 0, x, y, amsl + 15))
    gcs.fly(14.0)
    assert gcs.distance_to(30, 0) < 1.5
    assert gcs.vehicle.state.body.up_m == pytest.approx(15, abs=1.0)
    gcs.send(mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, 0, 0, x, y, 12))
    gcs.fly(5.0)
    assert gcs.vehicle.state.body.up_m < 10.0, "12 m above the sea is far below ground"


def test_change_speed_and_land_mode() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(15), waypoint(150, 0, 15), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 30)
    assert gcs.command(Cmd.DO_CHANGE_SPEED, 1, 2, -1) == [Result.ACCEPTED]
    gcs.fly(4.0)
    assert gcs.vehicle.state.body.ground_speed_m_s == pytest.approx(2.0, abs=0.4)
    assert gcs.command(Cmd.NAV_LAND) == [Result.ACCEPTED]
    gcs.until(lambda: not gcs.armed, 60.0)
    assert gcs.last("HEARTBEAT").custom_mode in (Mode.LAND, Mode.LOITER)
