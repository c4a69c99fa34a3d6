"""Pause, resume, jump and a new mission in flight: scenarios 08, 15 and 16."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RETURN, GroundStation, Plan, takeoff, waypoint

LONG = [takeoff(15), waypoint(60, 0, 15), waypoint(60, 60, 15), waypoint(0, 60, 15), RETURN]


def set_current(gcs: GroundStation, seq: int) -> None:
    gcs.send(mavlink.MAVLink_mission_set_current_message(1, 1, seq))


def test_without_autocontinue_the_vehicle_waits_for_a_set_current() -> None:
    gcs = GroundStation()
    stop = Plan(Cmd.NAV_WAYPOINT, 20, 0, 10, (0, 1, 0, 0), autocontinue=0)
    gcs.start([takeoff(10), stop, waypoint(20, 30, 10), RETURN])
    gcs.until(lambda: 1 in [m.seq for m in gcs.messages("MISSION_ITEM_REACHED")])
    gcs.fly(20.0)
    assert gcs.distance_to(20, 0) < 1.5
    set_current(gcs, 2)
    gcs.until(lambda: gcs.vehicle.state.body.east_m > 15, 20.0)


def test_hold_stops_within_some_metres_and_mission_mode_resumes_the_same_item() -> None:
    gcs = GroundStation()
    gcs.start(LONG)
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 25)
    assert gcs.set_mode(Mode.LOITER) == [Result.ACCEPTED]
    gcs.fly(6.0)
    assert gcs.vehicle.state.body.north_m == pytest.approx(31.9, abs=2.0)
    assert gcs.vehicle.state.body.ground_speed_m_s < 0.5
    assert (gcs.last("MISSION_CURRENT").mission_state, gcs.last("MISSION_CURRENT").mission_mode) == (4, 2)
    gcs.set_mode(Mode.MISSION)
    gcs.fly(1.5)
    assert (gcs.last("MISSION_CURRENT").seq, gcs.last("MISSION_CURRENT").mission_state) == (1, 3)
    gcs.set_mode(Mode.LOITER)
    gcs.fly(1.5)
    second = gcs.last("MISSION_CURRENT")
    assert (second.mission_state, second.mission_mode) == (3, 2), "a second pause shows in mission_mode only"


def test_set_current_acts_in_flight_and_224_while_holding_waits_for_the_resumption() -> None:
    gcs = GroundStation()
    gcs.start(LONG)
    gcs.until(lambda: gcs.vehicle.state.body.east_m > 11)
    set_current(gcs, 1)
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 1
    gcs.set_mode(Mode.LOITER)
    assert gcs.command(Cmd.DO_SET_MISSION_CURRENT, 3) == [Result.ACCEPTED]
    gcs.fly(2.0)
    assert gcs.last("MISSION_CURRENT").seq == 1
    gcs.set_mode(Mode.MISSION)
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 3


def test_a_supervised_drop_moves_on_by_set_current_without_a_reached() -> None:
    """Scenario 08."""
    gcs = GroundStation(params={"PD_GRIPPER_TO": 2.0})
    gcs.start([takeoff(15), waypoint(60, 0, 15, 30, 1), waypoint(60, 45, 15), RETURN])
    gcs.until(lambda: gcs.distance_to(60, 0) < 1.5 and gcs.vehicle.state.body.ground_speed_m_s < 0.3)
    assert gcs.command(Cmd.DO_GRIPPER, 1, 0, wait_s=2.5) == [Result.IN_PROGRESS, Result.ACCEPTED]
    set_current(gcs, 2)
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 2
    assert 1 not in [m.seq for m in gcs.messages("MISSION_ITEM_REACHED")]


def test_an_upload_in_flight_is_flown_at_once() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 40)
    assert gcs.upload([waypoint(0, 60, 25), waypoint(60, 60, 25), RETURN]) == 0
    new_id = gcs.last("MISSION_ACK").opaque_id
    gcs.fly(1.1)
    current = gcs.last("MISSION_CURRENT")
    assert (current.mission_id, current.seq, current.mission_state) == (new_id, 0, 3)
    gcs.until(lambda: gcs.distance_to(0, 60) < 11, 40.0)
    assert gcs.last("HEARTBEAT").custom_mode == Mode.MISSION


def test_an_infeasible_upload_in_flight_loses_the_old_mission() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 40)
    assert gcs.upload([waypoint(60, 0, 20), takeoff(20), RETURN]) == 0, "acknowledged all the same"
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").mission_state == 1
    assert "No valid mission available, loitering" in gcs.texts()
    assert gcs.last("HEARTBEAT").custom_mode == Mode.LOITER
    assert gcs.set_mode(Mode.MISSION) == [Result.TEMPORARILY_REJECTED]
    assert gcs.upload([waypoint(60, 0, 20), RETURN]) == 0
    gcs.fly(3.0)
    assert gcs.last("HEARTBEAT").custom_mode == Mode.LOITER, "it does not resume by itself"
    assert gcs.set_mode(Mode.MISSION) == [Result.ACCEPTED]


def test_a_bad_item_in_flight_leaves_the_old_mission_flying() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 40)
    gcs.upload([waypoint(60, 0, 20), Plan(16, 10, 0, 15, frame=8)])
    gcs.fly(3.0)
    assert gcs.vehicle.state.body.north_m > 50
    assert len(gcs.vehicle.store.mission) == 3


def test_a_fence_uploaded_in_flight_that_the_mission_leaves_loses_the_mission() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 20)
    assert gcs.upload([Plan(5003, 0, 0, 0, (80, 0, 0, 0))], 1) == 0
    gcs.fly(4.0)
    assert gcs.last("MISSION_CURRENT").mission_state == 1
    assert gcs.texts()[-2:] == ["Geofence violation for waypoint 2", "No valid mission available, loitering"]
    assert gcs.last("HEARTBEAT").custom_mode == Mode.LOITER


def test_a_takeoff_item_uploaded_in_the_air_is_a_waypoint() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(20), waypoint(150, 0, 20), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 60)
    gcs.upload([takeoff(20), waypoint(150, 0, 20), RETURN])
    gcs.fly(0.5)
    assert gcs.vehicle.context.setpoint.kind is SetpointKind.POSITION
    gcs.until(lambda: gcs.distance_to(0, 0) < 11, 60.0)


@pytest.mark.parametrize("last", [RETURN, waypoint(20, 0, 15)], ids=["return", "waypoint"])
def test_a_finished_mission_is_not_flown_again_in_the_air(last: Plan) -> None:
    """Seen of PX4 main: Mission mode is acknowledged, and it stays in Hold."""
    gcs = GroundStation()
    gcs.start([takeoff(15), waypoint(60, 0, 15), last])
    gcs.until(lambda: "Mission finished, loitering" in gcs.texts())
    gcs.fly(3.0)
    gcs.set_mode(Mode.LOITER)
    gcs.fly(3.0)
    assert gcs.set_mode(Mode.MISSION) == [Result.ACCEPTED]
    gcs.fly(1.5)
    assert gcs.texts()[-1] == "No valid mission available, loitering"
    assert gcs.vehicle.state.status.mode is Mode.LOITER
    set_current(gcs, 1)
    gcs.set_mode(Mode.MISSION)
    gcs.fly(1.5)
    assert gcs.vehicle.state.status.mode is Mode.MISSION, "another item is current"
