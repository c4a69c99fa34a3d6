"""Which tasks are queued, and where they are."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from shapely import Polygon

from app.domain.airspace.geofence import FenceArea
from app.domain.autopilot.capability import FirmwareProfile, FlightKind
from app.domain.errors import TaskRefusedError
from app.domain.geo import LocalProjection
from app.domain.offboard.control_method import ControlMethod, task_control_method
from app.domain.offboard.limits import OffboardLimits, VehiclePose
from app.domain.offboard.tasks.admission import course_of, refuse_beyond
from app.domain.offboard.tasks.commanded import Wing
from app.domain.offboard.tasks.course import CircleCourse, EkfOrigin, LegsCourse, PointCourse
from app.domain.vehicle.state import GlobalPosition, VehicleState
from tests.support.task_examples import EXAMPLES, ORIGIN, task, task_of

LIMITS = OffboardLimits(max_distance_m=200.0, max_altitude_m=60.0, min_altitude_m=5.0)
HOME = (ORIGIN.latitude_deg, ORIGIN.longitude_deg, 488.0)
AT_HOME = VehiclePose(kind=FlightKind.ROTARY, home=HOME, home_ned=(0.0, 0.0, 0.0))


def refusal(kind: str, where: VehiclePose = AT_HOME, limits: OffboardLimits = LIMITS, **changes: Any) -> str:
    """The code, or empty if the task is taken."""
    one = task(kind, **changes)
    try:
        refuse_beyond(one, course_of(one, ORIGIN, 0.0), ORIGIN.up_of(one, 488.0), limits, where)
    except TaskRefusedError as error:
        return error.refusal
    return ""


@pytest.mark.parametrize("kind", sorted(EXAMPLES))
@pytest.mark.parametrize("flies_like", [FlightKind.ROTARY, FlightKind.ROVER])
def test_the_examples_are_taken(kind: str, flies_like: FlightKind) -> None:
    assert refusal(kind, replace(AT_HOME, kind=flies_like), relative_altitude_m=30.0) == ""


@pytest.mark.parametrize(
    ("kind", "changes", "code"),
    [
        ("goto", {"point": {"east_m": 0.0, "north_m": 300.0}}, "limit.distance"),
        ("circle", {"radius_m": 190.0}, "limit.distance"),
        ("path", {"points": [{"east_m": 0.0, "north_m": 0.0}, {"east_m": 999.0, "north_m": 0.0}]}, "limit.distance"),
        ("goto", {"relative_altitude_m": 61.0}, "limit.altitude"),
        ("segment", {"absolute_altitude_m": 490.0}, "limit.altitude"),
        ("goto", {"speed_m_s": 11.0}, "limit.speed"),
        ("goto", {"motion": {"north_m_s": 8.0, "east_m_s": 8.0}}, "limit.speed"),
        ("segment", {"end": EXAMPLES["segment"]["start"]}, "task.no_length"),
    ],
)
def test_what_leads_beyond_a_limit_is_refused_before_it_is_flown(kind: str, changes: Any, code: str) -> None:
    assert refusal(kind, **changes) == code


@pytest.mark.parametrize("flies_like", [FlightKind.ROTARY, FlightKind.WING])
@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("goto", {"point": {"latitude_deg": 48.5, "longitude_deg": 8.5}}),
        ("goto", {"point": {"latitude_deg": -47.4, "longitude_deg": -171.5}}),
        ("circle", {"center": {"east_m": 99_999.0, "north_m": 0.0}, "radius_m": 500.0}),
        ("path", {"points": [{"east_m": 0.0, "north_m": 0.0}, {"latitude_deg": 0.0, "longitude_deg": 0.0}]}),
    ],
)
@pytest.mark.parametrize("limits", [LIMITS, OffboardLimits(max_distance_m=None)])
def test_what_is_farther_than_a_setpoint_can_say_is_refused_whatever_the_limits(
    kind: str, changes: Any, flies_like: FlightKind, limits: OffboardLimits
) -> None:
    assert refusal(kind, replace(AT_HOME, kind=flies_like), limits, **changes) == "limit.distance"


@pytest.mark.parametrize("kind", sorted(EXAMPLES))
def test_the_whole_course_must_lie_in_the_fence_and_not_only_its_corners(kind: str) -> None:
    wide = Polygon([(-100, -100), (100, -100), (100, 100), (-100, 100)])
    hole = Polygon([(8, 40), (12, 40), (12, 50), (8, 50)])  # on the segment and on the circle, between corners
    inside = replace(AT_HOME, fence=FenceArea(wide, None))
    assert refusal(kind, inside) == ""
    with_hole = replace(AT_HOME, fence=FenceArea(wide, hole))
    assert refusal(kind, with_hole) == ("" if kind == "goto" else "limit.fence")
    elsewhere = replace(AT_HOME, fence=FenceArea(Polygon([(500, 500), (600, 500), (600, 600)]), None))
    assert refusal(kind, elsewhere) == "limit.fence"


def test_a_fence_is_measured_from_home_and_a_task_from_the_origin() -> None:
    """Home 100 m north of the origin: 20 m north of the origin is 80 m south of home."""
    moved = replace(AT_HOME, home_ned=(100.0, 0.0, 0.0))
    south = FenceArea(Polygon([(-50, -90), (50, -90), (50, -70), (-50, -70)]), None)
    assert refusal("goto", replace(moved, fence=south)) == ""
    assert refusal("goto", replace(AT_HOME, fence=south)) == "limit.fence"


def test_a_fence_stays_where_it_is_when_home_moves() -> None:
    """Home was set anew 100 m north, and the vehicle counts from the same origin as before."""
    around = FenceArea(Polygon([(0, 0), (20, 0), (20, 90), (0, 90)]), None)
    moved = replace(AT_HOME, home_ned=(100.0, 0.0, 0.0), fence=around, fence_home=(100.0, 0.0))
    assert refusal("segment", moved) == ""
    assert refusal("goto", moved, point={"east_m": 10.0, "north_m": 120.0}) == "limit.fence"


def test_a_wing_neither_stops_for_the_gripper_nor_flies_small_circles() -> None:
    wing = replace(AT_HOME, kind=FlightKind.WING)
    assert refusal("goto", wing, gripper="release") == "task.cannot_stop"
    assert refusal("circle", wing, radius_m=-20.0) == "task.radius_too_small"
    assert refusal("circle", wing, radius_m=-60.0) == ""
    tight = replace(wing, fence=FenceArea(Polygon([(-70, -70), (70, -70), (70, 70), (-70, 70)]), None))
    assert refusal("goto", tight) == "limit.fence", "where it stays it circles"


@pytest.mark.parametrize(
    ("kind", "profile", "control_method"),
    [
        (FlightKind.ROTARY, FirmwareProfile.UNSURE, ControlMethod.SETPOINTS),
        (FlightKind.ROVER, FirmwareProfile.DOCUMENTED, ControlMethod.SETPOINTS),
        (FlightKind.WING, FirmwareProfile.FLOWN, ControlMethod.SETPOINTS),
        (FlightKind.WING, FirmwareProfile.UNSURE, ControlMethod.COMMANDS),
        (FlightKind.WING, FirmwareProfile.DOCUMENTED, ControlMethod.COMMANDS),
    ],
)
def test_what_does_not_follow_the_setpoints_is_flown_by_commands(
    kind: FlightKind, profile: FirmwareProfile, control_method: ControlMethod
) -> None:
    assert task_control_method(kind, profile) is control_method


@pytest.mark.parametrize("profile", FirmwareProfile)
def test_an_airship_gets_no_tasks_for_nothing_on_board_flies_it_to_a_place(profile: FirmwareProfile) -> None:
    with pytest.raises(TaskRefusedError, match="none that flies to a place") as refused:
        task_control_method(FlightKind.AIRSHIP, profile)
    assert refused.value.refusal == "setpoint.vehicle_unsupported"


def test_a_commanded_wing_needs_room_behind_each_leg_for_there_it_circles_when_nobody_speaks() -> None:
    where = replace(AT_HOME, kind=FlightKind.WING)
    made = task("segment", start={"east_m": 0.0, "north_m": 0.0}, end={"east_m": 0.0, "north_m": 400.0})
    course, limits, wing = course_of(made, ORIGIN, 0.0), OffboardLimits(max_distance_m=650.0), Wing(80.0, 2.24)
    refuse_beyond(made, course, 50.0, limits, where)
    with pytest.raises(TaskRefusedError, match="more than 650 m") as refused:
        refuse_beyond(made, course, 50.0, limits, where, wing)
    assert (refused.value.refusal, refused.value.hint[:34]) == ("limit.distance", "flown by commands it needs 285 m b")
    roomy = OffboardLimits(max_distance_m=700.0)
    refuse_beyond(made, course, 50.0, roomy, where, wing)
    fence = FenceArea(Polygon([(-60, -100), (300, -100), (300, 900), (-60, 900)]), None)
    with pytest.raises(TaskRefusedError, match="fence"):
        refuse_beyond(made, course, 50.0, roomy, replace(where, fence=fence), wing)


@pytest.mark.parametrize(
    "document",
    [
        {"type": "goto", "point": {"east_m": 1.0, "north_m": 2.0, "latitude_deg": 47.0}},
        {"type": "goto", "point": {"east_m": 1.0}},
        {"type": "goto", "point": {"east_m": 1.0, "north_m": 2.0}, "gripper": "release", "stay": True},
        {"type": "goto", **EXAMPLES["goto"], "relative_altitude_m": 5.0, "absolute_altitude_m": 500.0},
        {"type": "circle", "center": {"east_m": 1.0, "north_m": 2.0}, "radius_m": 0.0},
        {"type": "circle", "center": {"east_m": 1.0, "north_m": 2.0}, "radius_m": math.inf},
        {"type": "path", "points": []},
        {"type": "path", "points": [{"east_m": 1.0, "north_m": 2.0}] * 6},
        {"type": "spiral", "center": {"east_m": 1.0, "north_m": 2.0}},
    ],
)
def test_what_is_no_task_is_not_read(document: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        task_of(document)


def test_a_path_of_one_point_is_a_goto_and_repeated_points_are_one() -> None:
    point = {"east_m": 1.0, "north_m": 2.0}
    assert course_of(task("path", points=[point]), ORIGIN, 0.0) == PointCourse((2.0, 1.0))
    repeated = task("path", points=[point, point, {"east_m": 9.0, "north_m": 2.0}])
    assert course_of(repeated, ORIGIN, 0.0) == LegsCourse(((2.0, 1.0), (2.0, 9.0)))
    assert course_of(task("circle"), ORIGIN, 0.0) == CircleCourse((20.0, 10.0), -25.0)


@given(st.floats(-3000.0, 3000.0), st.floats(-3000.0, 3000.0), st.floats(-200.0, 200.0), st.floats(-75.0, 75.0))
def test_the_origin_is_found_from_home_wherever_home_is(
    north_m: float, east_m: float, down_m: float, latitude: float
) -> None:
    projection = LocalProjection(latitude, 8.5)
    place = projection.to_global(east_m, north_m)
    home = GlobalPosition(*place, 488.0)
    origin = EkfOrigin.of(VehicleState(home=home, home_ned_m=(north_m, east_m, down_m)))
    assert origin is not None
    assert origin.altitude_m == 488.0 + down_m
    assert origin.place(latitude, 8.5) == pytest.approx((0.0, 0.0), abs=0.01)
    assert origin.place(*place) == pytest.approx((north_m, east_m), abs=0.01)


def test_an_altitude_above_home_counts_from_home_as_it_is_now() -> None:
    assert ORIGIN.up_of(task("goto", relative_altitude_m=30.0), 488.0) == 30.0
    assert ORIGIN.up_of(task("goto", relative_altitude_m=30.0), 500.0) == 42.0
    assert ORIGIN.up_of(task("goto", absolute_altitude_m=500.0), 500.0) == 12.0


def test_without_home_in_both_frames_the_origin_is_not_known() -> None:
    assert EkfOrigin.of(VehicleState(home=GlobalPosition(47.0, 8.0, 400.0))) is None
