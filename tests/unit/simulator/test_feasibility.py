"""What a PX4 vehicle refuses to fly, and how it shows: scenarios 05, 14, 14b and 15b."""

from __future__ import annotations

import math

import pytest

from app.simulator.params import Value
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, Plan, do, land, takeoff, waypoint

TAKEOFF = takeoff(15)
PATTERN = [do(Cmd.DO_LAND_START), Plan(Cmd.NAV_LOITER_TO_ALT, 80, 300, 20, (1, 60, 0, 1)), land()]
RUNWAY = [takeoff(40, 160, 15), waypoint(400, 0, 40)]
VTOL_UP = takeoff(30, 60, command=Cmd.NAV_VTOL_TAKEOFF)


def judge(airframe: str, plans: list[Plan], **params: Value) -> GroundStation:
    gcs = GroundStation(airframe, params=params)
    assert gcs.upload(plans) == 0, "an infeasible mission is acknowledged all the same"
    gcs.fly(1.1)
    return gcs


def is_feasible(gcs: GroundStation) -> bool:
    return bool(gcs.last("MISSION_CURRENT").mission_state == 2)


@pytest.mark.parametrize(
    ("airframe", "plans", "params"),
    [
        ("quad", [waypoint(40, 0, 15), TAKEOFF, RETURN], {}),
        ("quad", [TAKEOFF, waypoint(40, 0, 15), land(), TAKEOFF, RETURN], {}),
        ("quad", [TAKEOFF, waypoint(40, 0, 15)], {"MIS_TKO_LAND_REQ": 4}),
        ("quad", [TAKEOFF, waypoint(40, 0, 15), RETURN], {"MIS_TKO_LAND_REQ": 4}),
        ("quad", [waypoint(40, 0, 15), RETURN], {"MIS_TKO_LAND_REQ": 1}),
        ("quad", [TAKEOFF, waypoint(40, 0, 15), RETURN], {"MIS_TKO_LAND_REQ": 3}),
        ("quad", [land(), waypoint(40, 0, 15)], {}),
        ("quad", [takeoff(-1), waypoint(40, 0, 15)], {}),
        ("quad", [VTOL_UP, waypoint(40, 0, 15)], {}),
        ("quad", [TAKEOFF, waypoint(90, 0, 15)], {"GF_MAX_HOR_DIST": 50.0}),
        ("quad", [TAKEOFF, waypoint(40, 0, 60)], {"GF_MAX_VER_DIST": 50.0}),
        ("plane", [*RUNWAY, waypoint(400, 300, 40)], {}),
        ("plane", [*RUNWAY, RETURN], {}),
        ("plane", [*RUNWAY, do(Cmd.DO_LAND_START), waypoint(30, 0, 60), land()], {}),
        ("plane", [*RUNWAY, do(Cmd.DO_LAND_START), waypoint(300, 0, 0), land()], {}),
        ("plane", [*RUNWAY, do(Cmd.DO_LAND_START), *PATTERN], {}),
        ("plane", [*RUNWAY, *PATTERN, RETURN], {}),
        ("plane", [*RUNWAY, Plan(Cmd.NAV_LOITER_TO_ALT, 30, 0, 20, (1, 60, 0, 1)), land()], {}),
        ("plane", [*RUNWAY, Plan(Cmd.NAV_LOITER_TIME, 300, 0, 20, (5, 0, 60, 0)), land()], {}),
        ("vtol", [VTOL_UP, waypoint(250, 0, 30), RETURN], {}),
    ],
)
def test_rejected_missions_stay_in_state_1(airframe: str, plans: list[Plan], params: dict[str, Value]) -> None:
    assert not is_feasible(judge(airframe, plans, **params))


@pytest.mark.parametrize(
    ("airframe", "plans", "params"),
    [
        ("quad", [TAKEOFF, waypoint(950, 0, 15), RETURN], {"MIS_DIST_1WP": 900.0}),
        ("quad", [waypoint(40, 0, 15), waypoint(60, 0, 15), RETURN], {}),
        ("quad", [TAKEOFF], {}),
        ("quad", [RELEASE], {}),
        ("quad", [TAKEOFF, waypoint(40, 0, -20), RETURN], {}),
        ("quad", [TAKEOFF, land(40), waypoint(80, 0, 15), RETURN], {}),
        ("quad", [TAKEOFF, RETURN, waypoint(40, 0, 15)], {}),
        ("quad", [TAKEOFF, do(Cmd.DO_JUMP, 9, 2), RETURN], {}),
        ("quad", [TAKEOFF, waypoint(40, 0, math.nan), RETURN], {}),
        ("quad", [TAKEOFF, do(Cmd.DO_GRIPPER, 1, 5), waypoint(40, 0, 15), RETURN], {}),
        ("quad", [TAKEOFF, waypoint(40, 0, 15), land()], {"MIS_TKO_LAND_REQ": 4}),
        ("quad", [RELEASE, TAKEOFF, waypoint(40, 0, 15)], {}),
        ("plane", [*RUNWAY, *PATTERN], {}),
        ("plane", [waypoint(400, 0, 40), *PATTERN], {}),
        ("vtol", [VTOL_UP, waypoint(250, 0, 30), land(command=Cmd.NAV_VTOL_LAND)], {}),
        ("rover", [waypoint(30, 0, 0)], {}),
    ],
)
def test_missions_that_px4_does_not_mind(airframe: str, plans: list[Plan], params: dict[str, Value]) -> None:
    assert is_feasible(judge(airframe, plans, **params))


def test_an_infeasible_mission_arms_but_cannot_be_started() -> None:
    gcs = judge("quad", [waypoint(40, 0, 15), TAKEOFF, RETURN])
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.ACCEPTED]
    assert gcs.set_mode(Mode.MISSION) == [Result.TEMPORARILY_REJECTED]
    assert gcs.texts()[-1] == "Switching to Mission is currently not available"
    assert gcs.command(Cmd.MISSION_START) == [Result.DENIED]
    assert gcs.texts()[-1] == "Mission start denied! No valid mission"


def test_the_reason_comes_as_an_event_and_only_the_fence_also_as_a_text() -> None:
    gcs = judge("quad", [waypoint(40, 0, 15), TAKEOFF, RETURN])
    assert 33440290 in [event.id for event in gcs.messages("EVENT")]
    assert gcs.texts() == []


def square(half_m: float) -> list[Plan]:
    corners = ((-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m))
    return [Plan(5001, north, east, 0, (4, 0, 0, 0)) for north, east in corners]


def test_a_waypoint_outside_the_fence_is_named_counting_from_one() -> None:
    gcs = GroundStation()
    gcs.upload(square(50), 1)
    gcs.upload([TAKEOFF, waypoint(40, 0, 15), waypoint(80, 0, 15), RETURN])
    gcs.fly(1.1)
    assert "Geofence violation for waypoint 3" in gcs.texts()
    assert not is_feasible(gcs)


def test_a_changed_fence_judges_the_stored_mission_again() -> None:
    gcs = judge("quad", [TAKEOFF, waypoint(40, 0, 15), RETURN])
    assert is_feasible(gcs)
    gcs.upload(square(20), 1)
    gcs.fly(0.5)
    assert "Geofence violation for waypoint 2" not in gcs.texts()
    gcs.fly(1.5)
    assert "Geofence violation for waypoint 2" in gcs.texts()
    assert not is_feasible(gcs)


def test_a_fence_without_home_is_announced_and_not_used() -> None:
    gcs = judge("quad", [TAKEOFF, waypoint(40, 0, 15), RETURN])
    gcs.upload([Plan(5004, 0, 0, 0, (30, 0, 0, 0))], 1)
    gcs.fly(2.0)
    assert "Geofence invalid, doesn't contain Home position" in gcs.texts()
    assert is_feasible(gcs)
    gcs.arm()


@pytest.mark.parametrize(("command", "radius_m", "feasible"), [(5003, 45, True), (5003, 41, False), (5004, 20, False)])
def test_a_circle_keeps_in_or_out(command: int, radius_m: float, feasible: bool) -> None:
    gcs = GroundStation()
    gcs.upload([Plan(command, 40, 0, 0, (radius_m, 0, 0, 0))], 1)
    gcs.upload([TAKEOFF, waypoint(40, 0, 15), waypoint(-4, 0, 15), RETURN])
    gcs.fly(1.1)
    assert is_feasible(gcs) == feasible
