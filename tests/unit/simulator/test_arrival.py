"""When an item counts as reached: each rule alone, with the vehicle put where the rule looks."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from app.simulator.navigator.arrival import Arrival
from app.simulator.navigator.target import Target, target_of
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, VtolState
from tests.support.simulated_vehicle import GroundStation, Plan, do, land, takeoff, waypoint

POINT = (500.0, 0.0)
UP_M = 40.0


class Leg:
    """A vehicle on its way from the origin to POINT at UP_M."""

    def __init__(self, airframe: str, command: int = Cmd.NAV_WAYPOINT, **params: float) -> None:
        self.gcs = GroundStation(airframe, params=params, ready=False)
        self.context = self.gcs.vehicle.context
        self.target = Target(command, POINT, UP_M, 0.0, 10.0, 80.0, True, False)
        self.arrival = Arrival(self.context)
        self.arrival.start()
        self.context.set_point(SetpointKind.LOITER, POINT, UP_M)

    def at(self, short_m: float, up_m: float = UP_M, east_m: float = 0.0, speed_m_s: float = 5.0) -> bool:
        """Whether it is reached so far before the point."""
        body = self.context.state.body
        body.north_m, body.east_m, body.up_m, body.v_north_m_s = POINT[0] - short_m, east_m, up_m, speed_m_s
        return self.arrival.completed(self.target)

    def course(self, degrees: float) -> None:
        body = self.context.state.body
        body.v_north_m_s, body.v_east_m_s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


# where ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("own_m", "reached"), [(3.0, True), (1.5, False)])
def test_a_multicopter_goes_by_the_items_own_radius(own_m: float, reached: bool) -> None:
    leg = Leg("quad")
    leg.target = replace(leg.target, acceptance_radius_m=own_m)
    assert leg.at(2.0) is reached


@pytest.mark.parametrize("airframe", ["rover", "airship"])
@pytest.mark.parametrize(("short_m", "reached"), [(4.9, True), (5.1, False)])
def test_the_others_by_nav_acc_rad_alone(airframe: str, short_m: float, reached: bool) -> None:
    leg = Leg(airframe, NAV_ACC_RAD=5.0)
    leg.target = replace(leg.target, acceptance_radius_m=50.0)
    assert leg.at(short_m) is reached


@pytest.mark.parametrize(
    ("speed_m_s", "params", "radius_m"),
    [
        (20.0, {}, 44.8),
        (2.0, {}, 10.0),  # at least NAV_ACC_RAD
        (2.0, {"NAV_ACC_RAD": 30.0}, 30.0),
        (20.0, {"NPFG_PERIOD": 100.0}, 448.0),
        (20.0, {"NPFG_PERIOD": 1000.0}, 500.0),  # at most 500 m
    ],
)
def test_a_fixed_wing_by_its_ground_speed_within_limits(
    speed_m_s: float, params: dict[str, float], radius_m: float
) -> None:
    leg = Leg("plane", **params)
    leg.context.state.body.v_north_m_s = speed_m_s
    assert leg.arrival.switch_radius_m(leg.target) == pytest.approx(radius_m)


@pytest.mark.parametrize(("short_m", "reached"), [(-1.0, True), (1.0, False)])
def test_a_fixed_wing_that_passes_far_beside_reaches_at_the_plane_through_the_point(
    short_m: float, reached: bool
) -> None:
    assert Leg("plane").at(short_m, east_m=200.0) is reached


def test_a_multicopter_that_passes_far_beside_does_not() -> None:
    assert not Leg("quad").at(-1.0, east_m=200.0)


# how high ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("airframe", "params", "off_m", "reached"),
    [
        ("quad", {}, 0.7, True),
        ("quad", {}, 0.9, False),
        ("quad", {"NAV_MC_ALT_RAD": 3.0}, 2.9, True),
        ("plane", {}, 9.9, True),
        ("plane", {}, 10.1, False),
        ("plane", {"NAV_FW_ALT_RAD": 20.0}, 19.0, True),
        ("rover", {}, 30.0, True),
    ],
)
@pytest.mark.parametrize("side", [1, -1])
def test_the_height_has_to_fit_but_for_a_rover(
    airframe: str, params: dict[str, float], off_m: float, reached: bool, side: int
) -> None:
    assert Leg(airframe, **params).at(0.3, UP_M + side * off_m) is reached


# how long ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("airframe", "command", "hold_s"),
    [
        ("quad", Cmd.NAV_WAYPOINT, 5.0),
        ("quad", Cmd.NAV_LOITER_TIME, 5.0),
        ("plane", Cmd.NAV_LOITER_TIME, 5.0),
        ("plane", Cmd.NAV_WAYPOINT, 0.0),
        ("rover", Cmd.NAV_WAYPOINT, 0.0),
        ("airship", Cmd.NAV_WAYPOINT, 0.0),
        ("quad", Cmd.NAV_LOITER_UNLIM, math.inf),
        ("plane", Cmd.NAV_LOITER_UNLIM, math.inf),
    ],
)
def test_the_hold_of_a_waypoint_counts_where_one_can_hover_that_of_a_loiter_everywhere(
    airframe: str, command: int, hold_s: float
) -> None:
    leg = Leg(airframe, command)
    leg.target = replace(leg.target, hold_s=5.0)
    held_s = 0.0
    while not leg.at(0.3) and held_s < 60.0:
        leg.gcs.vehicle.clock.advance()
        held_s += 0.02
    assert held_s == pytest.approx(min(hold_s, 60.0), abs=0.05)


# loiters of a fixed wing ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("short_m", "reached"), [(91.0, True), (92.0, False)])
def test_a_loiter_is_reached_on_its_orbit(short_m: float, reached: bool) -> None:
    """One switch distance before the circle [11_plane_loiter_delivery]."""
    assert Leg("plane", Cmd.NAV_LOITER_TIME).at(short_m) is reached


def test_a_loiter_to_altitude_comes_down_on_the_orbit_and_ends_at_its_altitude() -> None:
    leg = Leg("plane", Cmd.NAV_LOITER_TO_ALT)
    leg.context.setpoint.up_m = UP_M + 60.0
    assert not leg.at(200.0, UP_M)
    assert leg.context.setpoint.up_m == UP_M + 60.0, "not before it is there"
    assert not leg.at(80.0, UP_M + 60.0)
    assert leg.context.setpoint.up_m == UP_M
    assert not leg.at(80.0, UP_M + 10.1)
    assert leg.at(80.0, UP_M + 9.9)


@pytest.mark.parametrize("command", [Cmd.NAV_WAYPOINT, Cmd.NAV_LOITER_TO_ALT])
@pytest.mark.parametrize(
    ("airframe", "params", "off_m", "reached"),
    [
        ("plane", {}, 4.9, True),
        ("plane", {}, 5.1, False),
        ("plane", {"NAV_FW_ALTL_RAD": 8.0}, 7.9, True),
        ("vtol", {}, 9.9, True),  # it lands as a multicopter
        ("quad", {}, 0.9, False),
    ],
)
def test_before_a_landing_a_planes_height_has_to_fit_better(
    command: int, airframe: str, params: dict[str, float], off_m: float, reached: bool
) -> None:
    """NAV_FW_ALTL_RAD."""
    leg = Leg(airframe, command, **params)
    if airframe == "vtol":
        leg.context.state.status.vtol_state = VtolState.FW
    leg.context.setpoint.next_lands = True
    assert leg.at(0.3, UP_M + off_m) is reached


@pytest.mark.parametrize("command", [Cmd.NAV_LOITER_TO_ALT, Cmd.NAV_LOITER_TIME])
@pytest.mark.parametrize(
    ("course_deg", "next_m", "left"),
    [
        (0.0, 5000.0, True),
        (4.5, 5000.0, True),
        (-4.5, 5000.0, True),
        (7.0, 5000.0, False),
        (180.0, 5000.0, False),
        (180.0, 83.0, True),  # within the circle: it may never face the point
    ],
)
def test_a_loiter_that_says_so_is_left_towards_the_next_point_only(
    command: int, course_deg: float, next_m: float, left: bool
) -> None:
    leg = Leg("plane", command)
    leg.target = replace(leg.target, leave_towards_next=True)
    leg.context.setpoint.next = (POINT[0] + next_m, 0.0)
    body = leg.context.state.body
    body.north_m, body.up_m = POINT[0] - 80.0, UP_M
    leg.course(course_deg)
    assert leg.arrival.completed(leg.target) is left


@pytest.mark.parametrize(
    ("command", "params", "required"),
    [
        (Cmd.NAV_LOITER_TIME, (20.0, 1.0, 60.0, 0.0), True),
        (Cmd.NAV_LOITER_TIME, (20.0, 0.0, 60.0, 0.0), False),
        (Cmd.NAV_LOITER_TO_ALT, (1.0, 60.0, 0.0, 0.0), True),
        (Cmd.NAV_WAYPOINT, (0.0, 1.0, 0.0, 0.0), False),
    ],
)
def test_a_heading_is_required_by_loiter_times_second_parameter(
    command: int, params: tuple[float, float, float, float], required: bool
) -> None:
    gcs = GroundStation("plane")
    assert gcs.upload([takeoff(40), Plan(command, 400, 0, 40, params), waypoint(0, 0, 40)]) == 0
    item, context = gcs.vehicle.store.mission.items[1], gcs.vehicle.context
    assert target_of(item, context.frame, context.home, context.params).leave_towards_next is required


def test_a_loiter_by_turns_is_no_item_that_px4_takes() -> None:
    assert GroundStation("plane").upload([takeoff(40), Plan(Cmd.NAV_LOITER_TURNS, 400, 0, 40)]) == 3


@pytest.mark.parametrize(("up_m", "reached"), [(39.3, True), (39.1, False)])
def test_a_planes_takeoff_item_is_reached_by_its_height_wherever_that_is(up_m: float, reached: bool) -> None:
    assert Leg("plane", Cmd.NAV_TAKEOFF).at(400.0, up_m) is reached


def test_a_mission_says_of_each_item_whether_it_comes_before_a_landing() -> None:
    gcs = GroundStation("plane")
    gcs.start([waypoint(500, 0, 40), do(Cmd.DO_CHANGE_SPEED, 0, 11, -1), waypoint(900, 0, 40), land(1900)])
    setpoint, store = gcs.vehicle.context.setpoint, gcs.vehicle.store
    for seq, lands in ((0, False), (2, True), (3, False)):
        gcs.vehicle.mission.set_current(seq, at_once=True)
        gcs.until(lambda: setpoint.point != (0.0, 0.0) and not gcs.vehicle.state.status.landed, 60.0)
        gcs.fly(0.1)
        assert (store.current_seq, setpoint.next_lands) == (seq, lands)
