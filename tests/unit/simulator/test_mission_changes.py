"""Pause, resume, jump and a new mission in flight: scenarios 08, 15 and 16."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RETURN, Cockpit, Plan, takeoff, waypoint

LONG = [takeoff(15), waypoint(60, 0, 15), waypoint(60, 60, 15), waypoint(0, 60, 15), RETURN]


def set_current(cockpit: Cockpit, seq: int) -> None:
    cockpit.send(mavlink.MAVLink_mission_set_current_message(1, 1, seq))


def test_without_autocontinue_the_vehicle_waits_for_a_set_current() -> None:
    cockpit = Cockpit()
    stop = Plan(Cmd.NAV_WAYPOINT, 20, 0, 10, (0, 1, 0, 0), autocontinue=0)
    cockpit.start([takeoff(10), stop, waypoint(20, 30, 10), RETURN])
    cockpit.until(lambda: 1 in [m.seq for m in cockpit.messages("MISSION_ITEM_REACHED")])
    cockpit.fly(20.0)
    assert cockpit.distance_to(20, 0) < 1.5
    set_current(cockpit, 2)
    cockpit.until(lambda: cockpit.vehicle.state.body.east_m > 15, 20.0)


def test_hold_stops_within_some_metres_and_mission_mode_resumes_the_same_item() -> None:
    cockpit = Cockpit()
    cockpit.start(LONG)
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 25)
    assert cockpit.set_mode(Mode.LOITER) == [Result.ACCEPTED]
    cockpit.fly(6.0)
    assert cockpit.vehicle.state.body.north_m == pytest.approx(31.9, abs=2.0)
    assert cockpit.vehicle.state.body.ground_speed_m_s < 0.5
    assert (cockpit.last("MISSION_CURRENT").mission_state, cockpit.last("MISSION_CURRENT").mission_mode) == (4, 2)
    cockpit.set_mode(Mode.MISSION)
    cockpit.fly(1.5)
    assert (cockpit.last("MISSION_CURRENT").seq, cockpit.last("MISSION_CURRENT").mission_state) == (1, 3)
    cockpit.set_mode(Mode.LOITER)
    cockpit.fly(1.5)
    second = cockpit.last("MISSION_CURRENT")
    assert (second.mission_state, second.mission_mode) == (3, 2), "a second pause shows in mission_mode only"


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
    cockpit.fly(0.5)
    assert cockpit.vehicle.context.setpoint.kind is SetpointKind.POSITION
    cockpit.until(lambda: cockpit.distance_to(0, 0) < 11, 60.0)
