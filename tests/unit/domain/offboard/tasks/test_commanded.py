"""A wing flown by commands: which order a course gives, when it is said anew, and what goes over the wire."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.autopilot import behaviour_of
from app.domain.mission import MavCmd
from app.domain.offboard.tasks.commanded import CIRCLE_HERE, CircleAt, FlyTo, Wing, order, order_request
from app.domain.offboard.tasks.course import CircleCourse, LegsCourse, PointCourse
from app.domain.offboard.tasks.guidance import Fix, SetpointRequest
from app.domain.vehicle.state import FirmwareVersion, VehicleType
from tests.support.task_examples import ORIGIN

WING = Wing(80.0, 2.24)
NORTH = Fix((0.0, 0.0), 50.0, (15.0, 0.0))
LEG = LegsCourse(((0.0, 0.0), (500.0, 0.0)))
CORNER = LegsCourse(((0.0, 0.0), (500.0, 0.0), (500.0, 500.0)))
METRES = st.floats(-400.0, 400.0)


def test_a_circle_is_one_order_with_its_direction() -> None:
    first = order(SetpointRequest(CircleCourse((100.0, 50.0), -60.0), 40.0), NORTH, WING, None)
    assert first.order == CircleAt((100.0, 50.0), -60.0, 40.0)
    later = order(SetpointRequest(CircleCourse((100.0, 50.0), -60.0), 40.0), NORTH.ahead(5.0), WING, first.order)
    assert (later.order, later.arrived) == (first.order, False)


def test_a_goto_is_its_place_and_ends_on_the_circle_around_it() -> None:
    request = SetpointRequest(PointCourse((600.0, 0.0)), 50.0)
    far = order(request, NORTH, WING, None)
    assert (far.order, far.arrived) == (FlyTo((600.0, 0.0), 50.0), False)
    near = order(request, replace(NORTH, ground=(515.0, 0.0)), WING, far.order)
    assert (near.order, near.arrived) == (far.order, True)


def test_a_target_that_moves_is_said_anew_every_few_metres() -> None:
    before = order(SetpointRequest(PointCourse((100.0, 0.0)), 50.0), NORTH, WING, None).order
    for moved_m, is_new in ((4.0, False), (6.0, True)):
        found = order(SetpointRequest(PointCourse((100.0 + moved_m, 0.0)), 50.0), NORTH, WING, before).order
        assert (found != before) is is_new


def test_on_a_line_a_carrot_holds_until_its_circle_would_be_joined() -> None:
    request = SetpointRequest(LEG, 50.0)
    first = order(request, NORTH, WING, None).order
    assert first == FlyTo((pytest.approx(212.5), pytest.approx(0.0)), 50.0)
    assert order(request, NORTH.ahead(2.5), WING, first).order is first, "nothing is repeated that holds"
    assert order(request, NORTH.ahead(4.0), WING, first).order != first, "160 m before it PX4 would join the circle"
    assert order(replace(request, up_m=52.0), NORTH, WING, first).order != first, "another height is another order"


def test_beside_the_line_the_carrot_leads_back_to_it() -> None:
    right = replace(NORTH, ground=(100.0, 30.0))
    found = order(SetpointRequest(LEG, 50.0), right, WING, None)
    assert isinstance(found.order, FlyTo)
    assert found.reference.cross_m == pytest.approx(30.0)
    towards = math.atan2(found.order.ground[1] - 30.0, found.order.ground[0] - 107.5)
    assert towards == pytest.approx(-math.atan2(30.0, 60.0))


def test_at_a_corner_the_next_leg_counts_a_switch_distance_before_it_and_the_end_comes_as_early() -> None:
    turning = order(SetpointRequest(CORNER, 50.0), replace(NORTH, ground=(470.0, 0.0)), WING, None)
    assert (turning.reference.leg, turning.arrived) == (1, False)
    ended = order(SetpointRequest(CORNER, 50.0, leg=1), Fix((500.0, 470.0), 50.0, (0.0, 15.0)), WING, None)
    assert ended.arrived


@given(METRES, METRES, st.floats(0.0, 2.0 * math.pi), st.floats(0.0, 30.0))
def test_a_carrot_is_never_so_near_that_its_circle_is_joined(
    north_m: float, east_m: float, course: float, speed: float
) -> None:
    fix = Fix((north_m, east_m), 50.0, (speed * math.cos(course), speed * math.sin(course)))
    found = order(SetpointRequest(LEG, 50.0), fix, WING, None).order
    assert isinstance(found, FlyTo)
    assert math.dist(found.ground, fix.ahead(0.5).ground) > WING.joins_m(speed)


@pytest.mark.parametrize(
    ("version", "seconds"), [(FirmwareVersion(1, 13, 3), 4.77), (FirmwareVersion(1, 14, 0), 2.24), (None, 4.77)]
)
def test_the_circle_is_joined_earlier_by_older_guidance_and_by_larger_circles(
    version: FirmwareVersion | None, seconds: float
) -> None:
    known = behaviour_of(VehicleType.FIXED_WING, version)
    assert Wing.of(None, known) == Wing(80.0, seconds)
    assert Wing.of(-120.0, known).joins_m(15.0) == 240.0, "a negative NAV_LOITER_RAD is a direction"
    assert Wing.of(30.0, known).joins_m(20.0) == pytest.approx(40.0 * seconds)


def test_altitudes_go_out_above_sea_level_and_places_as_whole_numbers() -> None:
    there = order_request(FlyTo((100.0, 0.0), 50.0), ORIGIN)
    assert there.command is MavCmd.DO_REPOSITION
    assert there.params[:2] == (-1.0, 1.0), "its own speed, and Hold if it was in another mode"
    assert there.params[6] == pytest.approx(538.0), "the origin is 488 m above the sea"
    assert there.place == (pytest.approx(473986412, abs=30), 85455940)
    round_it = order_request(CircleAt((0.0, 0.0), -60.0, 50.0), ORIGIN)
    assert (round_it.command, round_it.params[0], round_it.params[6]) == (MavCmd.DO_ORBIT, -60.0, 538.0)
    assert all(math.isnan(value) for value in round_it.params[1:4])


def test_to_circle_here_is_a_reposition_without_a_place() -> None:
    assert CIRCLE_HERE.place is None
    assert all(math.isnan(value) for value in CIRCLE_HERE.params[2:])
    assert CIRCLE_HERE.params[:2] == (-1.0, 1.0)
