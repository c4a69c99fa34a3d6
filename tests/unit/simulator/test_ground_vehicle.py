"""What drives may be disarmed at any time: it cannot fall [13_rover_delivery]."""

from __future__ import annotations

import pytest

from app.simulator.events import EVENTS
from app.simulator.wire import Cmd, Result
from tests.support.simulated_vehicle import GroundStation, do, takeoff, waypoint

REFUSED = EVENTS["commander_disarm_denied_not_landed"][0]


@pytest.mark.parametrize("seconds", [3.0, 60.0])
def test_a_rover_is_disarmed_while_it_drives_and_after_its_mission(seconds: float) -> None:
    rover = GroundStation("rover")
    rover.start([waypoint(30.0, 0.0, 0.0), waypoint(30.0, 25.0, 0.0)])
    rover.fly(seconds)
    assert rover.command(Cmd.COMPONENT_ARM_DISARM, 0) == [Result.ACCEPTED]
    assert not rover.armed
    assert rover.texts()[-1] == "Disarmed by external command"


@pytest.mark.parametrize("is_set", [False, True])
def test_home_moves_to_where_a_rovers_return_begins_unless_it_was_given(is_set: bool) -> None:
    """This return goes to the home of before all the same."""
    rover = GroundStation("rover")
    rover.start([waypoint(30.0, 0.0, 0.0)])
    rover.until(lambda: rover.vehicle.mission.result.finished)
    rover.fly(3.0)
    if is_set:
        there = rover.vehicle.spec.frame.to_global(1.0, 0.0)
        assert rover.command(Cmd.DO_SET_HOME, 0, 0, 0, 0, *there, rover.vehicle.spec.frame.altitude_m) == [
            Result.ACCEPTED
        ]
    rover.command(Cmd.NAV_RETURN_TO_LAUNCH)
    rover.fly(2.0)
    home = rover.vehicle.state.status.home
    assert home is not None
    assert home.north_m == pytest.approx(1.0 if is_set else 25.0, abs=0.1 if is_set else 6.0)
    rover.until(lambda: not rover.armed)
    assert rover.vehicle.state.body.north_m < 12.0
    assert rover.command(Cmd.DO_SET_HOME, 1) == [Result.ACCEPTED]
    home = rover.vehicle.state.status.home
    assert home is not None
    assert home.north_m == pytest.approx(rover.vehicle.state.body.north_m)


def test_a_quad_is_not_and_its_event_says_why() -> None:
    quad = GroundStation()
    quad.start([takeoff(10.0), waypoint(30.0, 0.0, 10.0)])
    quad.until(lambda: quad.vehicle.state.body.up_m > 5.0)
    assert quad.command(Cmd.COMPONENT_ARM_DISARM, 0) == [Result.TEMPORARILY_REJECTED]
    assert REFUSED in [one.id for one in quad.messages("EVENT")]


def test_a_rover_ignores_the_hold_of_a_waypoint() -> None:
    flown_s = []
    for hold_s in (0.0, 20.0):
        gcs = GroundStation("rover")
        gcs.start([waypoint(20, 0, 0, hold_s=hold_s), waypoint(20, 20, 0)])
        started_s = gcs.now_s
        gcs.until(lambda at=gcs: at.vehicle.mission.result.finished)  # type: ignore[misc]
        flown_s.append(gcs.now_s - started_s)
    assert flown_s[1] == pytest.approx(flown_s[0], abs=0.1)


def test_a_rover_drives_the_leg_after_its_turn_as_slowly_as_px4() -> None:
    """25 m east from a stand took PX4 10.9 s: the SIH's drag squares each axis of the earth by itself."""
    rover = GroundStation("rover")
    rover.start([waypoint(30.0, 0.0, 0.0), do(Cmd.NAV_DELAY, 5.0), waypoint(30.0, 25.0, 0.0)])
    rover.until(lambda: rover.vehicle.mission.result.seq_reached == 1)
    started_s = rover.now_s
    rover.until(lambda: rover.vehicle.mission.result.seq_reached == 2)
    assert rover.now_s - started_s == pytest.approx(10.9, abs=0.6)


def test_a_rover_that_waits_at_its_point_stands_still_and_keeps_its_heading() -> None:
    rover = GroundStation("rover")
    rover.start([waypoint(30.0, 0.0, 0.0), do(Cmd.NAV_DELAY, 10.0), waypoint(30.0, 25.0, 0.0)])
    rover.until(lambda: rover.vehicle.mission.result.seq_reached == 0)
    rover.fly(3.0)
    body = rover.vehicle.state.body
    heading_rad, place = body.yaw_rad, (body.north_m, body.east_m)
    rover.fly(5.0)
    assert body.ground_speed_m_s == 0.0
    assert (body.north_m, body.east_m) == place
    assert place == pytest.approx((30.0, 0.0), abs=0.5)
    assert body.yaw_rad == heading_rad


def driving() -> GroundStation:
    """North, at its full speed."""
    rover = GroundStation("rover")
    rover.start([waypoint(200.0, 0.0, 0.0), waypoint(200.0, 50.0, 0.0)])
    rover.until(lambda: rover.vehicle.state.body.north_m > 20.0)
    assert rover.vehicle.state.body.ground_speed_m_s == pytest.approx(2.95, abs=0.1)
    return rover


def test_in_land_mode_a_rover_keeps_its_speed_until_it_is_disarmed_and_rolls_on() -> None:
    """Flown twice: "Landing detected" at once, 2.95 m/s for two seconds, 12 m in all."""
    rover = driving()
    body = rover.vehicle.state.body
    start_m, speed_m_s = body.north_m, body.ground_speed_m_s
    assert rover.command(Cmd.NAV_LAND) == [Result.ACCEPTED]
    rover.fly(0.5)
    assert "Landing detected" in rover.texts()
    assert rover.until(lambda: not rover.armed, 5.0) == pytest.approx(1.5, abs=0.3)
    assert body.ground_speed_m_s == pytest.approx(speed_m_s, abs=0.05)
    rover.until(lambda: body.ground_speed_m_s == 0.0, 10.0)
    assert (body.north_m - start_m, body.east_m) == pytest.approx((12.0, 0.0), abs=0.6)


def test_a_rover_that_stands_does_not_start_in_land_mode() -> None:
    rover = GroundStation("rover")
    rover.start([waypoint(20.0, 0.0, 0.0)])
    rover.until(lambda: rover.vehicle.mission.result.finished)
    rover.fly(3.0)
    body = rover.vehicle.state.body
    place = (body.north_m, body.east_m)
    assert rover.command(Cmd.NAV_LAND) == [Result.ACCEPTED]
    rover.until(lambda: not rover.armed, 5.0)
    assert (body.north_m, body.east_m) == place


def test_a_rover_that_is_disarmed_as_it_drives_rolls_on() -> None:
    rover = driving()
    start_m = rover.vehicle.state.body.north_m
    assert rover.command(Cmd.COMPONENT_ARM_DISARM, 0) == [Result.ACCEPTED]
    rover.fly(6.0)
    assert rover.vehicle.state.body.ground_speed_m_s == 0.0
    assert rover.vehicle.state.body.north_m - start_m == pytest.approx(6.0, abs=0.5)
