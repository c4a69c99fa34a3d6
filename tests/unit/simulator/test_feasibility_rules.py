"""PX4's feasibility checks one by one: each finds what it is for, by its parameter, and nothing else."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from app.simulator.airframe import AIRFRAMES
from app.simulator.firmware import PROFILES
from app.simulator.geo import LocalFrame
from app.simulator.mission.feasibility import FeasibilityInput, first_waypoint_m, problems
from app.simulator.mission.geofence import Geofence
from app.simulator.mission.item import Item
from app.simulator.params import Params
from app.simulator.state import Home
from app.simulator.wire import Cmd
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, Plan, do, land, takeoff, waypoint

FRAME = LocalFrame(47.397742, 8.545594, 488.0)
HOME = Home(0.0, 0.0, 0.0)
TAKEOFF, LAND_START = takeoff(15), do(Cmd.DO_LAND_START)
UP, DOWN = takeoff(40, 160, 15), Plan(Cmd.NAV_LOITER_TO_ALT, 80, 300, 20, (1, 60, 0, 1))
VTOL_LAND = land(command=Cmd.NAV_VTOL_LAND)


def item_of(plan: Plan) -> Item:
    x = y = 0
    if plan.north_m is not None:
        latitude, longitude = FRAME.to_global(plan.north_m, plan.east_m)
        x, y = round(latitude * 1e7), round(longitude * 1e7)
    frame = plan.frame if plan.frame is not None else (6 if plan.north_m is not None else 2)
    return Item(plan.command, frame, 1, *plan.params, x, y, plan.up_m)


def checked(
    airframe: str, plans: list[Plan], fence: list[Plan] | None = None, firmware: str = "px4-main", **params: float
) -> FeasibilityInput:
    """A mission of a vehicle that stands at home."""
    return FeasibilityInput(
        items=tuple(item_of(plan) for plan in plans),
        airframe=AIRFRAMES[airframe],
        params=Params(AIRFRAMES[airframe].params, params),
        frame=FRAME,
        home=HOME,
        fence=Geofence(tuple(item_of(plan) for plan in fence or ()), FRAME),
        landed=True,
        profile=PROFILES[firmware],
    )


def found(mission: FeasibilityInput) -> list[str]:
    return [problem.event.removeprefix("navigator_mis_") for problem in problems(mission)]


# all types --------------------------------------------------------------------------------------------------


def test_without_a_home_nothing_is_feasible() -> None:
    assert found(replace(checked("quad", [TAKEOFF]), home=None)) == ["no_home_rel_alt"]


@pytest.mark.parametrize(("up_m", "main", "old"), [(0.0, True, True), (10.9, False, True), (11.0, False, False)])
def test_up_to_v1_15_a_takeoff_goes_1_m_above_the_acceptance_radius(up_m: float, main: bool, old: bool) -> None:
    for firmware, too_low in (("px4-main", main), ("px4-1.14", old), ("px4-1.13", old)):
        mission = checked("quad", [takeoff(up_m), waypoint(10, 0, 15)], firmware=firmware, NAV_ACC_RAD=10.0)
        assert found(mission) == ["takeoff_too_low"] * too_low


@pytest.mark.parametrize("limit_m", [100.0, 0.0])
def test_up_to_v1_15_a_first_waypoint_beyond_mis_dist_1wp_is_infeasible(limit_m: float) -> None:
    for firmware in PROFILES:
        mission = checked("quad", [waypoint(101, 0, 15)], firmware=firmware, MIS_DIST_1WP=limit_m)
        assert found(mission) == ["first_wp_too_far"] * (firmware != "px4-main" and limit_m > 0.0)


@pytest.mark.parametrize("command", [Cmd.NAV_VTOL_TAKEOFF, Cmd.NAV_VTOL_LAND, Cmd.DO_VTOL_TRANSITION])
@pytest.mark.parametrize("airframe", ["quad", "rover"])
def test_vtol_items_are_for_vtols(airframe: str, command: int) -> None:
    item = Plan(command, 10, 0, 10) if command != Cmd.DO_VTOL_TRANSITION else do(command, 3)
    assert "unsup_cmd" in found(checked(airframe, [waypoint(5, 0, 10), item]))
    assert "unsup_cmd" not in found(checked("vtol", [waypoint(5, 0, 10), item]))


def test_a_landing_comes_first_only_in_the_air() -> None:
    mission = checked("quad", [land(), waypoint(10, 0, 10)])
    assert found(mission) == ["starts_w_landing"]
    assert found(replace(mission, landed=False)) == []


@pytest.mark.parametrize(
    ("up_m", "frame", "too_low"), [(0.0, 6, True), (0.5, 6, False), (487.0, 5, True), (489.0, 5, False)]
)
def test_a_takeoff_lies_above_home_whatever_its_frame(up_m: float, frame: int, too_low: bool) -> None:
    assert found(checked("quad", [replace(takeoff(up_m), frame=frame)])) == ["takeoff_too_low"] * too_low


def test_a_takeoff_comes_before_every_other_position_but_not_before_commands() -> None:
    assert found(checked("quad", [waypoint(5, 0, 10), TAKEOFF])) == ["takeoff_not_first"]
    assert found(checked("quad", [TAKEOFF, TAKEOFF])) == ["takeoff_not_first"]
    assert found(checked("quad", [RELEASE, do(Cmd.DO_CHANGE_SPEED, 1, 3), TAKEOFF])) == []


@pytest.mark.parametrize(
    ("requirement", "plans", "problem"),
    [
        (0, [waypoint(5, 0, 10)], []),
        (1, [waypoint(5, 0, 10), land()], ["takeoff_missing"]),
        (1, [TAKEOFF], []),
        (2, [TAKEOFF, RETURN], ["land_missing"]),
        (2, [waypoint(5, 0, 10), land()], []),
        (3, [waypoint(5, 0, 10), land()], ["takeoff_or_land_missing"]),
        (3, [TAKEOFF, RETURN], ["takeoff_or_land_missing"]),
        (3, [TAKEOFF, land()], []),
        (4, [TAKEOFF, RETURN], ["add_land_or_rm_to"]),
        (4, [waypoint(5, 0, 10), land()], ["add_to_or_rm_land"]),
        (4, [waypoint(5, 0, 10)], []),
        (5, [TAKEOFF, RETURN], ["add_land_or_rm_to"]),
        (5, [TAKEOFF, land()], []),
    ],
)
def test_mis_tko_land_req_says_what_a_mission_needs(requirement: int, plans: list[Plan], problem: list[str]) -> None:
    assert found(checked("quad", plans, MIS_TKO_LAND_REQ=requirement)) == problem


@pytest.mark.parametrize(("requirement", "problem"), [(4, ["add_land_or_rm_to"]), (5, [])])
def test_in_the_air_5_asks_for_nothing(requirement: int, problem: list[str]) -> None:
    mission = checked("quad", [TAKEOFF, RETURN], MIS_TKO_LAND_REQ=requirement)
    assert found(replace(mission, landed=False)) == problem


def test_the_first_waypoint_may_be_far_but_that_is_said() -> None:
    assert first_waypoint_m(checked("quad", [RELEASE, waypoint(950, 0, 15)])) == pytest.approx(950, abs=0.1)
    for limit_m, said in ((900.0, True), (1000.0, False), (0.0, False)):
        gcs = GroundStation(params={"MIS_DIST_1WP": limit_m})
        gcs.upload([waypoint(950, 0, 15)])
        gcs.fly(1.1)
        assert (22091529 in [event.id for event in gcs.messages("EVENT")]) is said
        assert gcs.last("MISSION_CURRENT").mission_state == 2


# landing patterns -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("airframe", ["plane", "vtol"])
def test_a_landing_pattern_comes_once_before_its_landing_and_no_return_follows(airframe: str) -> None:
    ending = [DOWN, land()] if airframe == "plane" else [VTOL_LAND]
    first = UP if airframe == "plane" else takeoff(30, 60, command=Cmd.NAV_VTOL_TAKEOFF)
    assert found(checked(airframe, [first, LAND_START, *ending])) == []
    assert found(checked(airframe, [first, LAND_START, LAND_START, *ending])) == ["multiple_land"]
    assert found(checked(airframe, [first, LAND_START, *ending, RETURN])) == ["land_before_rtl"]
    assert found(checked(airframe, [first, *ending, LAND_START])) == ["invalid_land"]


def test_what_hovers_or_drives_may_have_any_landing_pattern() -> None:
    assert found(checked("quad", [TAKEOFF, LAND_START, LAND_START, RETURN])) == []
    assert found(checked("quad", [TAKEOFF, waypoint(3, 0, 60), land()])) == []


@pytest.mark.parametrize(
    ("before", "problem"),
    [
        ([DOWN], []),
        ([waypoint(300, 0, 20)], []),
        ([Plan(Cmd.NAV_LOITER_TIME, 300, 0, 20, (5, 0, 60, 0))], ["unsupported_landing_approach_wp"]),
        ([RELEASE], ["unsupported_landing_approach_wp"]),
        ([waypoint(300, 0, 0)], ["approach_wp_below_land"]),
        ([waypoint(300, 0, -5)], ["approach_wp_below_land"]),
        ([Plan(Cmd.NAV_LOITER_TO_ALT, 59, 0, 4, (1, 60, 0, 1))], ["land_wp_inside_orbit_radius"]),
        ([Plan(Cmd.NAV_LOITER_TO_ALT, 79, 0, 4, (1, 0, 0, 1))], ["land_wp_inside_orbit_radius"]),  # NAV_LOITER_RAD
        ([waypoint(300, 0, 26)], []),  # 5.0 degrees
        ([waypoint(300, 0, 27.5)], ["glide_slope_too_steep"]),  # 5.2 degrees
        # from the tangent point of the orbit 100 m away it is steeper than from its centre
        ([Plan(Cmd.NAV_LOITER_TO_ALT, 100, 0, 8, (1, 60, 0, 1))], ["glide_slope_too_steep"]),
        ([Plan(Cmd.NAV_LOITER_TO_ALT, 100, 0, 7, (1, 60, 0, 1))], []),
    ],
)
def test_the_approach_of_a_fixed_wing(before: list[Plan], problem: list[str]) -> None:
    assert found(checked("plane", [UP, LAND_START, *before, land()])) == problem


def test_a_fixed_wings_landing_needs_an_approach_at_all() -> None:
    mission = replace(checked("plane", [land(), LAND_START, DOWN, land()]), landed=False)
    assert found(mission) == ["starts_w_landing2"]


@pytest.mark.parametrize(("angle_deg", "problem"), [(3.0, ["glide_slope_too_steep"]), (10.0, [])])
def test_the_slope_is_fw_lnd_angs(angle_deg: float, problem: list[str]) -> None:
    steep = waypoint(300, 0, 300 * math.tan(math.radians(4.9)))
    assert found(checked("plane", [UP, LAND_START, steep, land()], FW_LND_ANG=angle_deg)) == problem


# fences -----------------------------------------------------------------------------------------------------


def square(half_m: float, command: int = 5001, north_m: float = 0.0) -> list[Plan]:
    corners = ((-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m))
    return [Plan(command, north_m + north, east, 0, (4, 0, 0, 0)) for north, east in corners]


@pytest.mark.parametrize(
    ("fence", "params", "violated"),
    [
        ([], {}, False),
        (square(70), {}, False),
        (square(50), {}, True),
        (square(10, 5002, 60), {}, True),
        (square(10, 5002, 90), {}, False),
        ([Plan(5003, 0, 0, 0, (70, 0, 0, 0))], {}, False),
        ([Plan(5003, 0, 0, 0, (50, 0, 0, 0))], {}, True),
        ([Plan(5004, 60, 0, 0, (10, 0, 0, 0))], {}, True),
        ([*square(50), Plan(5003, 60, 0, 0, (10, 0, 0, 0))], {}, False),  # inside one of two is enough
        (square(20, 5001, 60), {}, False),  # home is outside: the fence is invalid and not used
        ([], {"GF_MAX_HOR_DIST": 50.0}, True),
        ([], {"GF_MAX_HOR_DIST": 70.0}, False),
        ([], {"GF_MAX_VER_DIST": 14.0}, True),
        ([], {"GF_MAX_VER_DIST": 16.0}, False),
    ],
)
def test_every_waypoint_lies_inside_the_fences(fence: list[Plan], params: dict[str, float], violated: bool) -> None:
    mission = checked("quad", [TAKEOFF, waypoint(60, 0, 15)], fence, **params)
    assert found(mission) == ["geofence_violation"] * violated


def test_legs_between_waypoints_are_not_looked_at() -> None:
    assert found(checked("quad", [TAKEOFF, waypoint(60, 0, 15)], square(10, 5002, 30))) == []


def test_a_polygon_that_lacks_vertices_contains_nothing() -> None:
    """Scenario 05: three vertices sent with count 4 are taken."""
    mission = [TAKEOFF, waypoint(42, -5, 15)]
    for vertices, violated in ((3, False), (4, True)):
        fence = square(15, 5002, 35)[:vertices]
        assert found(checked("quad", mission, fence)) == ["geofence_violation"] * violated


def test_a_fence_without_home_is_said() -> None:
    for north_m, text in ((60.0, "Geofence invalid, doesn't contain Home position"), (0.0, "")):
        gcs = GroundStation()
        assert gcs.upload(square(20, 5001, north_m), 1) == 0
        gcs.fly(1.0)
        assert "".join(gcs.texts()) == text
