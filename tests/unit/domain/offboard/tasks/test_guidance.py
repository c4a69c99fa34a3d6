"""Guidance: from anywhere it leads onto the course and along it, never faster than asked."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import SetpointRefusedError
from app.domain.offboard.limits import LOOK_AHEAD_S, OffboardLimits
from app.domain.offboard.setpoints import PositionNed, PositionVelocityNed, VelocityNed
from app.domain.offboard.tasks.admission import course_of
from app.domain.offboard.tasks.course import CircleCourse, Course, Ground, LegsCourse, PointCourse
from app.domain.offboard.tasks.guidance import ARRIVED_M, Fix, SetpointRequest, VerticalSpeeds, stand, steer
from tests.support.task_examples import EXAMPLES, ORIGIN, task

ROTARY, WING, ROVER = FlightKind.ROTARY, FlightKind.WING, FlightKind.ROVER
places = st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0))
LINE = LegsCourse(((0.0, 0.0), (100.0, 0.0)))
CORNER = LegsCourse(((0.0, 0.0), (50.0, 0.0), (50.0, 50.0)))


def still(ground: Ground, up_m: float = 30.0) -> Fix:
    return Fix(ground, up_m, (0.0, 0.0))


def course(kind: str, **changes: Any) -> Course:
    return course_of(task(kind, **changes), ORIGIN, 0.0)


@given(here=places, kind=st.sampled_from(sorted(EXAMPLES)), speed=st.floats(0.5, 12.0), rover=st.booleans())
def test_no_velocity_is_faster_than_the_task_asks(here: Ground, kind: str, speed: float, rover: bool) -> None:
    request = SetpointRequest(course(kind), 30.0, speed_m_s=speed)
    setpoint = steer(ROVER if rover else ROTARY, request, still(here)).setpoint
    if isinstance(setpoint, VelocityNed):
        assert math.hypot(setpoint.north_m_s, setpoint.east_m_s) <= speed * (1 + 1e-9)


@given(
    here=places,
    motion=st.tuples(st.floats(-200.0, 200.0), st.floats(-200.0, 200.0)),
    speed=st.floats(0.5, 150.0),
    kind=st.sampled_from([ROTARY, ROVER, WING]),
)
def test_however_fast_a_target_moves_there_is_a_setpoint(
    here: Ground, motion: Ground, speed: float, kind: FlightKind
) -> None:
    setpoint = steer(
        kind, SetpointRequest(PointCourse((0.0, 0.0), motion), 30.0, speed_m_s=speed), still(here)
    ).setpoint
    if isinstance(setpoint, VelocityNed):
        assert math.hypot(setpoint.north_m_s, setpoint.east_m_s) <= 150.0 + 1e-6


@pytest.mark.parametrize("kind", [ROTARY, ROVER, WING])
def test_a_target_that_has_moved_farther_than_a_setpoint_can_say_is_refused(kind: FlightKind) -> None:
    gone = PointCourse((100_500.0, 0.0))
    with pytest.raises(SetpointRefusedError, match="farther"):
        steer(kind, SetpointRequest(gone, 30.0, stays=kind is WING), still((100_500.0, 0.0)))


@given(here=places, kind=st.sampled_from(sorted(EXAMPLES)))
def test_a_wing_gets_a_point_of_the_course_and_the_tangent_there(here: Ground, kind: str) -> None:
    flown = course(kind)
    setpoint = steer(WING, SetpointRequest(flown, 30.0), still(here)).setpoint
    assert isinstance(setpoint, PositionVelocityNed)
    assert setpoint.down_m == -30.0
    point = (setpoint.north_m, setpoint.east_m)
    assert math.hypot(setpoint.north_m_s, setpoint.east_m_s) == pytest.approx(15.0)
    if isinstance(flown, CircleCourse):
        assert math.dist(point, flown.center) == pytest.approx(abs(flown.radius_m))
        out = (point[0] - flown.center[0], point[1] - flown.center[1])
        assert out[0] * setpoint.north_m_s + out[1] * setpoint.east_m_s == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kind", [ROTARY, WING, ROVER])
@pytest.mark.parametrize("radius_m", [40.0, -40.0])
def test_the_sign_of_the_radius_is_the_direction(kind: FlightKind, radius_m: float) -> None:
    """In the north of the centre: clockwise is east."""
    setpoint = steer(kind, SetpointRequest(CircleCourse((0.0, 0.0), radius_m), 30.0), still((40.0, 0.0))).setpoint
    assert isinstance(setpoint, VelocityNed | PositionVelocityNed)
    assert math.copysign(1.0, setpoint.east_m_s) == math.copysign(1.0, radius_m)


@settings(max_examples=20)
@given(here=places, kind=st.sampled_from(["goto", "segment", "path"]), speed=st.floats(3.0, 8.0))
def test_a_simple_vehicle_gets_to_the_end_from_anywhere(here: Ground, kind: str, speed: float) -> None:
    flown = course(kind)
    end = flown.points[-1] if isinstance(flown, LegsCourse) else flown.point  # type: ignore[union-attr]
    assert math.dist(flown_to_its_end(flown, here, speed)[-1], end) <= ARRIVED_M + 1e-6


def test_a_path_that_comes_by_its_own_end_is_flown_in_full() -> None:
    """Near the end it is told the place, and would stay there: only its last leg may end so."""
    far = (100.0, 50.0)
    way = flown_to_its_end(LegsCourse(((0.0, 0.0), far, (100.0, 0.0), (0.0, 0.0))), (0.0, 0.0), 5.0)
    assert min(math.dist(at, far) for at in way) < 2.0
    entered = flown_to_its_end(CORNER, (50.0, 49.0), 5.0)
    assert min(math.dist(at, (50.0, 0.0)) for at in entered) < 2.0, "the corner is before the end"


def flown_to_its_end(course: Course, here: Ground, speed_m_s: float) -> list[Ground]:
    """The places that a simple vehicle comes to, until it has arrived; in 800 s it must."""
    way, leg = [here], 0
    for _ in range(4_000):
        seen = steer(ROTARY, SetpointRequest(course, 30.0, leg, speed_m_s), still(way[-1]))
        leg = seen.reference.leg
        if seen.arrived:
            return way
        way.append(moved(way[-1], seen.setpoint))
    raise AssertionError(f"it has not arrived, and is at {way[-1]} on leg {leg}")


def moved(at: Ground, setpoint: Any, step_s: float = 0.2) -> Ground:
    """A vehicle that does at once what it is told."""
    if isinstance(setpoint, PositionNed):
        return setpoint.north_m, setpoint.east_m
    return at[0] + setpoint.north_m_s * step_s, at[1] + setpoint.east_m_s * step_s


def test_beside_a_segment_it_flies_the_line_and_not_only_to_its_end() -> None:
    at, beside = (10.0, 8.0), []
    for _ in range(80):
        at = moved(at, steer(ROTARY, SetpointRequest(LINE, 30.0, speed_m_s=5.0), still(at)).setpoint)
        beside.append(abs(at[1]))
    assert beside == sorted(beside, reverse=True), "it only comes nearer"
    assert at[0] < 95.0
    assert beside[-1] < 0.01


def test_what_passes_the_end_of_a_segment_far_beside_it_has_not_flown_it() -> None:
    seen = steer(ROTARY, SetpointRequest(LINE, 30.0), still((120.0, 14.0)))
    assert not seen.arrived
    assert isinstance(seen.setpoint, VelocityNed)
    assert seen.setpoint.north_m_s < 0.0
    assert steer(WING, SetpointRequest(LINE, 30.0), still((120.0, 14.0))).arrived, "a wing cannot turn on the spot"


def test_a_corner_is_slowed_for_and_a_straight_joint_is_not() -> None:
    def speed_at(legs: LegsCourse) -> float:
        setpoint = steer(ROTARY, SetpointRequest(legs, 30.0, speed_m_s=5.0), still((48.0, 0.0))).setpoint
        assert isinstance(setpoint, VelocityNed)
        return math.hypot(setpoint.north_m_s, setpoint.east_m_s)

    assert speed_at(CORNER) < 2.0
    assert speed_at(LegsCourse(((0.0, 0.0), (50.0, 0.0), (100.0, 0.0)))) == pytest.approx(5.0)


@given(away=st.floats(0.0, 60.0), bearing=st.floats(0.0, 6.3), speed=st.floats(0.5, 12.0))
def test_a_goto_never_leads_beyond_its_place_within_the_limiters_look_ahead(
    away: float, bearing: float, speed: float
) -> None:
    """Else a place near the fence could not be reached: the limiter would stop the vehicle before it."""
    here = (away * math.cos(bearing), away * math.sin(bearing))
    setpoint = steer(ROTARY, SetpointRequest(PointCourse((0.0, 0.0)), 30.0, speed_m_s=speed), still(here)).setpoint
    if isinstance(setpoint, VelocityNed):
        ahead = math.hypot(setpoint.north_m_s, setpoint.east_m_s) * LOOK_AHEAD_S
        assert ahead <= away + 1e-6


@pytest.mark.parametrize(("up_m", "down_m_s"), [(0.0, -2.0), (200.0, 1.5), (30.0, 0.0)])
def test_height_is_taken_up_on_the_way_with_bounded_climb_and_descent(up_m: float, down_m_s: float) -> None:
    setpoint = steer(ROTARY, SetpointRequest(LINE, 30.0), still((10.0, 0.0), up_m)).setpoint
    assert isinstance(setpoint, VelocityNed)
    assert setpoint.down_m_s == down_m_s


def test_a_place_is_not_reached_at_another_height_but_a_rover_has_none() -> None:
    request = SetpointRequest(PointCourse((0.0, 0.0)), 30.0)
    assert not steer(ROTARY, request, still((0.0, 0.0), 20.0)).arrived
    assert steer(ROTARY, request, still((0.3, 0.0), 30.4)).arrived
    assert steer(ROVER, request, still((0.3, 0.0), 0.0)).arrived


@pytest.mark.parametrize("flown", [PointCourse((0.0, 0.0)), LegsCourse(((-50.0, 0.0), (0.0, 0.0)))])
def test_a_place_is_not_reached_beside_it_or_in_passing(flown: Course) -> None:
    """Flown: ended at 1 m and 2 m/s, a goto came to rest 1.09 m away."""
    request = SetpointRequest(flown, 30.0)
    assert steer(ROTARY, request, still((-0.3, 0.0))).arrived
    assert not steer(ROTARY, request, still((-0.9, 0.0))).arrived
    assert not steer(ROTARY, request, Fix((-0.3, 0.0), 30.0, (1.0, 0.0))).arrived


def test_a_target_that_moves_is_reached_in_passing() -> None:
    ship = SetpointRequest(PointCourse((0.0, 0.0), (3.0, 0.0)), 30.0)
    assert steer(ROTARY, ship, Fix((-0.9, 0.0), 30.0, (3.0, 0.0))).arrived


@given(here=places, kind=st.sampled_from(["goto", "segment", "path"]), lag_s=st.floats(-3.0, 3.0))
def test_where_nothing_turns_a_lag_changes_nothing(here: Ground, kind: str, lag_s: float) -> None:
    request = SetpointRequest(course(kind), 30.0, speed_m_s=5.0)
    assert steer(ROTARY, request, still(here), lag_s) == steer(ROTARY, request, still(here))


@given(here=places, speed=st.floats(0.5, 12.0), lag_s=st.floats(-3.0, 3.0))
def test_what_makes_up_for_a_lag_is_never_faster_than_the_task_asks(here: Ground, speed: float, lag_s: float) -> None:
    request = SetpointRequest(course("circle"), 30.0, speed_m_s=speed)
    setpoint = steer(ROTARY, request, still(here), lag_s).setpoint
    assert isinstance(setpoint, VelocityNed)
    assert math.hypot(setpoint.north_m_s, setpoint.east_m_s) <= speed * (1 + 1e-9)


@pytest.mark.parametrize("radius_m", [20.0, -20.0])
def test_with_a_lag_it_aims_inside_the_circle(radius_m: float) -> None:
    circle = SetpointRequest(CircleCourse((0.0, 0.0), radius_m), 30.0, speed_m_s=5.0)
    setpoint = steer(ROTARY, circle, still((20.0, 0.0)), 0.8).setpoint
    assert isinstance(setpoint, VelocityNed)
    assert setpoint.north_m_s == pytest.approx(-0.8 * 5.0**2 / 20.0)
    assert math.copysign(1.0, setpoint.east_m_s) == math.copysign(1.0, radius_m)


def test_near_its_place_it_is_told_the_place_and_stays_there_with_the_heading_asked_for() -> None:
    setpoint = steer(ROTARY, SetpointRequest(PointCourse((5.0, 6.0)), 30.0, yaw_deg=90.0), still((5.0, 7.0))).setpoint
    assert setpoint == PositionNed(type="position_ned", north_m=5.0, east_m=6.0, down_m=-30.0, yaw_deg=90.0)
    rover = stand(ROVER, (5.0, 6.0), 0.0, still((5.0, 7.0)))
    assert rover == PositionNed(type="position_ned", north_m=5.0, east_m=6.0)


def test_what_cannot_stand_circles_the_place() -> None:
    setpoint = stand(WING, (0.0, 0.0), 50.0, still((0.0, 0.0)))
    assert isinstance(setpoint, PositionVelocityNed)
    assert math.hypot(setpoint.north_m, setpoint.east_m) == pytest.approx(80.0)


def test_a_moving_target_is_flown_with_its_own_velocity_and_stands_when_nobody_tells_it_anew() -> None:
    ship = PointCourse((0.0, 0.0), (3.0, 0.0), since_s=100.0)
    assert ship.at(104.0, 5.0) == PointCourse((12.0, 0.0), (3.0, 0.0), 104.0)
    assert ship.at(130.0, 5.0) == PointCourse((15.0, 0.0), (0.0, 0.0), 130.0)
    beside = steer(ROTARY, SetpointRequest(ship.at(104.0, 5.0), 30.0), Fix((12.0, 0.0), 30.0, (3.0, 0.0))).setpoint
    assert isinstance(beside, VelocityNed)
    assert beside.north_m_s == pytest.approx(3.0, abs=0.7)


@pytest.mark.parametrize(("kind", "arrives"), [(FlightKind.ROVER, True), (FlightKind.ROTARY, False)])
def test_a_rover_that_px4_has_stopped_at_its_acceptance_radius_has_arrived(kind: FlightKind, arrives: bool) -> None:
    at = Fix((9.3, 0.0), 0.0, (0.0, 0.0))
    assert steer(kind, SetpointRequest(PointCourse((10.0, 0.0)), 0.0), at).arrived is arrives
    rolling = Fix((9.3, 0.0), 0.0, (0.5, 0.0))
    assert not steer(kind, SetpointRequest(PointCourse((10.0, 0.0)), 0.0), rolling).arrived


@pytest.mark.parametrize(
    ("changes", "up_m", "down_m_s"),
    [
        ({}, 90.0, -2.0),
        ({}, 2.0, 1.5),
        ({"max_climb_m_s": 0.5}, 90.0, -0.5),
        ({"max_descend_m_s": 1.0}, 2.0, 1.0),
        ({"max_climb_m_s": None, "max_descend_m_s": None}, 90.0, -2.0),
    ],
)
def test_it_climbs_and_descends_no_faster_than_the_limits_allow(
    changes: dict[str, float | None], up_m: float, down_m_s: float
) -> None:
    vertical = VerticalSpeeds.within(OffboardLimits.model_validate(changes))
    far = PointCourse((50.0, 0.0))
    for setpoint in (
        steer(ROTARY, SetpointRequest(far, up_m, vertical=vertical), still((0.0, 0.0))).setpoint,
        stand(ROTARY, far.point, up_m, still((0.0, 0.0)), vertical),
    ):
        assert isinstance(setpoint, VelocityNed)
        assert setpoint.down_m_s == down_m_s
