"""DO_ORBIT: a multicopter's orbit mode and a plane's loiter, as in scenarios 22."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from app.simulator.dialect import Message, mavlink
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import NAN, GroundStation

CENTRE = (60.0, 0.0)
NO_PLACE = 2147483647


def orbit(
    gcs: GroundStation, radius_m: float, speed_m_s: float, centre: tuple[float, float] | None, yaw: float = 0.0
) -> int:
    """COMMAND_INT at the present height; the ack's result."""
    x = y = NO_PLACE
    if centre is not None:
        x, y = (round(degrees * 1e7) for degrees in gcs.vehicle.spec.frame.to_global(*centre))
    gcs.send(mavlink.MAVLink_command_int_message(1, 1, 0, Cmd.DO_ORBIT, 0, 0, radius_m, speed_m_s, yaw, 0, x, y, NAN))
    gcs.fly(0.1)
    return int(gcs.last("COMMAND_ACK").result)


def airborne(airframe: str = "quad") -> GroundStation:
    gcs = GroundStation(airframe, params={"MIS_TAKEOFF_ALT": 15.0})
    gcs.set_mode(Mode.TAKEOFF)
    gcs.arm()
    gcs.until(lambda: mode(gcs) is Mode.LOITER, 60.0)
    return gcs


def mode(gcs: GroundStation) -> Mode:
    return gcs.vehicle.state.status.mode


def turned_rad(gcs: GroundStation, seconds: float, centre: tuple[float, float] = CENTRE) -> float:
    """How far round the centre it flies, clockwise positive."""
    body, total = gcs.vehicle.state.body, 0.0
    before = math.atan2(body.east_m - centre[1], body.north_m - centre[0])
    for _ in range(round(seconds / 0.1)):
        gcs.fly(0.1)
        now = math.atan2(body.east_m - centre[1], body.north_m - centre[0])
        total += math.remainder(now - before, math.tau)
        before = now
    return total


@pytest.fixture(scope="module")
def circling() -> GroundStation:
    """Radius 15 m at 3 m/s round a point 60 m ahead, well on its way."""
    gcs = airborne()
    assert orbit(gcs, 15.0, 3.0, CENTRE) == Result.ACCEPTED
    gcs.until(lambda: gcs.distance_to(*CENTRE) < 16.5, 40.0)
    gcs.fly(6.0)
    return gcs


def test_the_heartbeat_shows_posctl_with_sub_mode_1(circling: GroundStation) -> None:
    heartbeat = circling.last("HEARTBEAT")
    assert (heartbeat.custom_mode >> 16 & 0xFF, heartbeat.custom_mode >> 24) == (3, 1)


def test_it_flies_round_the_centre_at_the_speed_asked_for(circling: GroundStation) -> None:
    """Recorded: 15.7 m away at 2.6 m/s, drag takes the rest."""
    turned = turned_rad(circling, 20.0)
    assert circling.distance_to(*CENTRE) == pytest.approx(15.7, abs=0.4)
    assert circling.vehicle.state.body.ground_speed_m_s == pytest.approx(2.6, abs=0.3)
    assert turned == pytest.approx(20.0 * 2.6 / 15.7, rel=0.1)


def test_the_nose_points_to_the_centre(circling: GroundStation) -> None:
    body = circling.vehicle.state.body
    inwards = math.atan2(CENTRE[1] - body.east_m, CENTRE[0] - body.north_m)
    assert math.remainder(body.yaw_rad - inwards, math.tau) == pytest.approx(0.0, abs=0.1)


def status(gcs: GroundStation) -> Message:
    return gcs.last("ORBIT_EXECUTION_STATUS")


def test_the_status_tells_radius_centre_and_height_above_the_sea(circling: GroundStation) -> None:
    lat, lon = circling.vehicle.spec.frame.to_global(*CENTRE)
    altitude_m = circling.vehicle.spec.frame.altitude_m + circling.vehicle.state.body.up_m
    shown = status(circling)
    assert (shown.radius, shown.frame) == (15.0, 0)
    assert (shown.x, shown.y) == (round(lat * 1e7), round(lon * 1e7))
    assert shown.z == pytest.approx(altitude_m, abs=0.5)


def test_it_is_sent_once_a_second_and_only_while_there_is_an_orbit() -> None:
    gcs = airborne()
    assert gcs.messages("ORBIT_EXECUTION_STATUS") == []
    orbit(gcs, 15.0, 3.0, CENTRE)
    gcs.fly(10.0)
    assert len(gcs.messages("ORBIT_EXECUTION_STATUS")) in (9, 10, 11)
    gcs.set_mode(Mode.LOITER)
    mark = len(gcs.messages("ORBIT_EXECUTION_STATUS"))
    gcs.fly(3.0)
    assert len(gcs.messages("ORBIT_EXECUTION_STATUS")) == mark


def test_a_negative_radius_turns_the_other_way_and_no_place_keeps_the_centre(circling: GroundStation) -> None:
    assert orbit(circling, -20.0, 3.0, None) == Result.ACCEPTED
    circling.until(lambda: circling.distance_to(*CENTRE) > 19.5, 40.0)
    circling.fly(5.0)
    assert turned_rad(circling, 10.0) < -1.0
    assert circling.distance_to(*CENTRE) == pytest.approx(20.5, abs=0.8)
    assert status(circling).radius == -20.0


def test_a_small_circle_is_flown_slower() -> None:
    """Two metres a second squared towards the centre at most."""
    gcs = airborne()
    orbit(gcs, 8.0, 9.0, (0.0, 0.0))
    gcs.fly(20.0)
    assert 2.5 < gcs.vehicle.state.body.ground_speed_m_s < 3.2  # of 4 commanded, drag takes the rest


@pytest.mark.parametrize(("yaw", "expected"), [(1.0, 0.0), (3.0, math.pi / 2.0)])
def test_the_heading_is_as_commanded(yaw: float, expected: float) -> None:
    """1 keeps the heading of the command (north), 3 looks along the circle: a right angle to the left of outwards."""
    gcs = airborne()
    orbit(gcs, 15.0, 3.0, (15.0, 0.0), yaw)
    gcs.fly(20.0)
    body = gcs.vehicle.state.body
    outwards = math.atan2(body.east_m, body.north_m - 15.0)
    reference = 0.0 if yaw == 1.0 else outwards
    assert math.remainder(body.yaw_rad - reference - expected, math.tau) == pytest.approx(0.0, abs=0.15)


@pytest.mark.parametrize("radius_m", [0.5, 1001.0])
def test_an_impossible_radius_is_said_and_not_flown(radius_m: float) -> None:
    gcs = airborne()
    assert orbit(gcs, radius_m, 3.0, CENTRE) == Result.ACCEPTED
    gcs.fly(1.5)
    assert "Orbit radius limit exceeded" in gcs.texts()
    assert abs(status(gcs).radius) == 1.0


def turns(gcs: GroundStation, centre: tuple[float, float], seconds: float) -> Sequence[float]:
    return [turned_rad(gcs, seconds / 4.0, centre) for _ in range(4)]


@pytest.mark.parametrize("radius_m", [100.0, -100.0])
def test_a_plane_stays_in_hold_and_loiters_with_that_radius(radius_m: float) -> None:
    gcs, centre = airborne("plane"), (200.0, 150.0)
    assert orbit(gcs, radius_m, 12.0, centre) == Result.ACCEPTED
    gcs.fly(45.0)
    assert mode(gcs) is Mode.LOITER
    assert gcs.distance_to(*centre) == pytest.approx(100.0, abs=12.0)
    assert all(math.copysign(1.0, turn) == math.copysign(1.0, radius_m) for turn in turns(gcs, centre, 8.0))
    assert status(gcs).radius == radius_m


def test_a_plane_that_loiters_tells_its_circle_unasked() -> None:
    """Scenario 22: 80 m, the height above home."""
    gcs = airborne("plane")
    gcs.fly(2.0)
    assert status(gcs).radius == 80.0
    assert status(gcs).z == pytest.approx(gcs.vehicle.context.setpoint.up_m, abs=0.1)


def test_a_rover_takes_the_mode_and_stays_where_it_is() -> None:
    gcs = GroundStation("rover")
    gcs.arm()
    assert orbit(gcs, 15.0, 2.0, CENTRE) == Result.ACCEPTED
    gcs.fly(5.0)
    assert mode(gcs) is Mode.ORBIT
    assert gcs.distance_to(0.0, 0.0) < 0.5


def test_amid_a_transition_it_is_rejected() -> None:
    gcs = airborne("vtol")
    gcs.command(Cmd.DO_VTOL_TRANSITION, 4)
    assert orbit(gcs, 100.0, 10.0, CENTRE) == Result.TEMPORARILY_REJECTED
    assert gcs.texts()[-1] == "Orbit command rejected"
