"""Which way a multicopter's trajectory takes, and how fast: turns, lines, heights, waiting (scenarios 15, 25)."""

from __future__ import annotations

import math

import pytest

from app.simulator.dynamics.multicopter import FlightTrack
from app.simulator.dynamics.position_smoothing import Leg, Point, PositionSmoothing
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind

DT_S = 0.02
CRUISE_M_S = 5.0


def smoothing(here: Point = (0.0, 0.0, 20.0), velocity: Point = (0.0, 0.0, 0.0)) -> PositionSmoothing:
    made = PositionSmoothing(Params())
    made.axes[2].max_velocity_m_s, made.axes[2].max_acceleration_m_s2 = 3.0, 4.0
    made.reset(here, velocity)
    return made


def fly(made: PositionSmoothing, leg: Leg, seconds: float) -> Point:
    """With a vehicle that is where its trajectory is."""
    for _ in range(round(seconds / DT_S)):
        made.step(made.position, leg, CRUISE_M_S, None, DT_S)
    return made.position


def straight(target: Point, after: Point | None = None, start: Point = (0.0, 0.0, 20.0)) -> Leg:
    return Leg(start, target, after or target, 10.0)


def speed(made: PositionSmoothing) -> float:
    return math.hypot(made.axes[0].velocity_m_s, made.axes[1].velocity_m_s)


@pytest.mark.parametrize(
    ("after", "arrival_m_s"),
    [
        ((60.0, 60.0, 20.0), math.sqrt(0.5 * 3.0 * 10.0)),  # MPC_XY_TRAJ_P x MPC_ACC_HOR x radius x tan(90 deg / 2)
        ((120.0, 0.0, 20.0), CRUISE_M_S),
        ((60.0, 5.0, 20.0), 0.0),  # the next point is within the radius: stop
    ],
)
def test_the_speed_at_a_waypoint_is_what_the_turn_allows(after: Point, arrival_m_s: float) -> None:
    made = smoothing()
    leg = straight((60.0, 0.0, 20.0), after)
    while made.position[0] < 59.5:
        fly(made, leg, DT_S)
    assert speed(made) == pytest.approx(arrival_m_s, abs=0.75)


def test_a_turn_joins_the_line_ahead_of_the_vehicle_instead_of_heading_for_the_waypoint() -> None:
    made = smoothing((5.0, 0.0, 20.0), (4.0, 0.0, 0.0))
    north_m, east_m, _ = fly(made, straight((0.0, 100.0, 20.0)), 12.0)
    assert north_m == pytest.approx(0.0, abs=1.0)
    assert 20.0 < east_m < 60.0


def test_the_speed_does_not_rise_before_the_turn_is_over() -> None:
    made = smoothing((0.0, 0.0, 20.0), (2.0, 0.0, 0.0))
    fly(made, Leg((0.0, 0.0, 20.0), (3.0, 0.0, 20.0), (3.0, 0.0, 20.0), 10.0), 0.1)
    slow = speed(made)
    fly(made, straight((0.0, 100.0, 20.0)), 1.0)
    assert speed(made) <= slow


@pytest.mark.parametrize(("climbs", "up_m"), [(True, 25.0), (False, 21.0)])
def test_the_trajectory_waits_for_a_vehicle_that_is_left_behind_in_height_and_on_the_level_apart(
    climbs: bool, up_m: float
) -> None:
    """Scenario 15: climbing at 1.5 m/s all through a turn in which the vehicle is a metre behind."""
    made = smoothing()
    leg = straight((100.0, 0.0, 25.0))
    for _ in range(500):
        made.step((0.0, 0.0, made.position[2] if climbs else 20.0), leg, CRUISE_M_S, None, DT_S)
    assert made.position[0] < 2.0  # MPC_XY_ERR_MAX
    assert made.position[2] == pytest.approx(up_m, abs=0.5)  # MPC_Z_ERR_MAX


def test_a_turn_climbs_towards_the_waypoints_height_and_not_along_the_line() -> None:
    """Scenario 15: while it swings out backwards the vehicle climbs all the time."""
    made = smoothing((0.0, 0.0, 20.0), (4.5, 0.0, 0.0))
    leg = straight((-50.0, 60.0, 25.0))
    heights = [fly(made, leg, 0.2)[2] for _ in range(25)]
    assert heights == sorted(heights)
    assert heights[-1] > 24.0


def test_a_different_height_after_the_waypoint_lets_it_arrive_climbing_and_so_swing_past() -> None:
    """Scenario 25: 0.6 m to 0.9 m to both sides of the 10 m of a waypoint before a landing."""
    made = smoothing((0.0, 0.0, 5.0))
    heights = [fly(made, straight((40.0, 0.0, 10.0), (40.0, 0.0, 0.0)), 0.1)[2] for _ in range(70)]
    assert max(heights) > 10.3
    level = smoothing((0.0, 0.0, 5.0))
    assert max(fly(level, straight((40.0, 0.0, 10.0)), 0.1)[2] for _ in range(70)) < 10.05


# the flight task's own points ----------------------------------------------------------------------------------


def leg(body: Point, *, previous: tuple[float, float] | None = (0.0, 0.0), kind: SetpointKind) -> Leg:
    setpoint = Setpoint(kind, 100.0, 0.0, 20.0, previous=previous, next=(100.0, 100.0))
    setpoint.previous_up_m = setpoint.next_up_m = 20.0
    return FlightTrack().leg(body, setpoint)


@pytest.mark.parametrize(
    ("body", "target", "after"),
    [
        ((50.0, 5.0, 20.0), (100.0, 0.0, 20.0), (100.0, 100.0, 20.0)),  # near the line: along it
        ((50.0, 30.0, 20.0), (50.0, 0.0, 20.0), (100.0, 0.0, 20.0)),  # far beside it: back to it first
        ((-30.0, 0.0, 20.0), (0.0, 0.0, 20.0), (100.0, 0.0, 20.0)),  # before its start: there first
        ((120.0, 0.0, 20.0), (100.0, 0.0, 20.0), (100.0, 100.0, 20.0)),  # beyond: straight to the target
    ],
)
def test_a_vehicle_far_from_its_line_goes_back_to_it_first(body: Point, target: Point, after: Point) -> None:
    found = leg(body, kind=SetpointKind.POSITION)
    assert (found.target, found.after) == (target, after)


def test_without_a_start_there_is_no_line_to_go_back_to() -> None:
    track = FlightTrack()
    setpoint = Setpoint(SetpointKind.POSITION, 100.0, 0.0, 20.0)
    for body in ((0.0, 40.0, 20.0), (60.0, 80.0, 20.0)):
        found = track.leg(body, setpoint)
        assert found.start == found.target == (100.0, 0.0, 20.0)


def test_the_way_back_to_a_passed_waypoint_begins_where_it_was_found_to_be_passed() -> None:
    track = FlightTrack()
    setpoint = Setpoint(SetpointKind.POSITION, 100.0, 0.0, 20.0, previous=(0.0, 0.0), previous_up_m=20.0)
    assert track.leg((101.0, 3.0, 20.0), setpoint).start == (101.0, 3.0, 20.0)
    assert track.leg((103.0, 3.0, 20.0), setpoint).start == (101.0, 3.0, 20.0)


@pytest.mark.parametrize("kind", [SetpointKind.LOITER, SetpointKind.LAND])
def test_nothing_comes_after_a_loiter_or_a_landing(kind: SetpointKind) -> None:
    found = leg((50.0, 0.0, 20.0), kind=kind)
    assert found.after == found.target
