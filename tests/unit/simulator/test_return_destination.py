"""Where a return ends, by RTL_TYPE, with and without a landing in the mission and rally points."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from app.simulator.navigator.return_plan import ReturnDestination, Way
from app.simulator.wire import Cmd
from tests.support.airborne_vehicle import Airborne
from tests.support.simulated_vehicle import GroundStation, Plan, do, land, takeoff, waypoint

HOME, GARDEN, RALLY = (0.0, 0.0), (60.0, 0.0), (40.0, 30.0)


def chosen(
    rtl_type: int,
    *,
    garden: bool,
    rally: Sequence[tuple[float, float]] = (),
    north_m: float,
    seq: int = 1,
    marker: bool = False,
    airframe: str = "quad",
) -> tuple[Way, tuple[float, float]]:
    """By a vehicle on its way at north_m; its mission would land in the garden and fly on."""
    gcs = GroundStation(airframe, params={"RTL_TYPE": rtl_type, "MIS_TKO_LAND_REQ": 0}, ready=False)
    gcs.fly(3.0)
    if rally:
        assert gcs.upload([Plan(5100, *point, 15, (0, 0, 0, 0)) for point in rally], 2) == 0
    landing = [*([do(Cmd.DO_LAND_START)] if marker else []), land(*GARDEN)] if garden else []
    gcs.upload([takeoff(10), waypoint(20, 0, 10), waypoint(40, 0, 10), *landing, waypoint(80, 0, 10)])
    gcs.fly(0.1)
    vehicle = gcs.vehicle
    vehicle.state.body.north_m, vehicle.store.current_seq = north_m, seq
    plan = ReturnDestination(vehicle.context, vehicle.store, vehicle.mission.result).choose()
    return plan.way, plan.point


@pytest.mark.parametrize(
    ("rtl_type", "garden", "rally", "north_m", "way", "place"),
    [
        (0, True, [], 50.0, Way.DIRECT, HOME),  # the landing does not count
        (0, True, [RALLY], 50.0, Way.DIRECT, RALLY),
        (0, False, [RALLY], 10.0, Way.DIRECT, HOME),
        (0, False, [(8.0, 0.0)], 30.0, Way.DIRECT, HOME),  # a rally point as near as that to home is none
        (0, False, [(12.0, 0.0)], 30.0, Way.DIRECT, (12.0, 0.0)),
        (0, False, [(30.0, 0.0), (62.0, 0.0)], 46.0, Way.DIRECT, (30.0, 0.0)),  # as near as the other
        (1, True, [], 20.0, Way.TO_LANDING, GARDEN),  # even when home is nearer
        (1, True, [RALLY], 20.0, Way.DIRECT, RALLY),
        (1, False, [], 50.0, Way.DIRECT, HOME),
        (3, True, [RALLY], 50.0, Way.TO_LANDING, GARDEN),
        (3, True, [RALLY], 10.0, Way.DIRECT, HOME),
        (3, True, [], 31.0, Way.DIRECT, HOME),  # the landing is nearer, but by less than 2 m
        (3, True, [], 31.5, Way.TO_LANDING, GARDEN),
        (5, True, [RALLY], 10.0, Way.DIRECT, RALLY),
        (5, False, [(8.0, 0.0)], 30.0, Way.DIRECT, (8.0, 0.0)),
        (5, True, [], 50.0, Way.DIRECT, (50.0, 0.0)),  # where it is
    ],
)
def test_a_direct_return_ends_where_rtl_type_says(
    rtl_type: int,
    garden: bool,
    rally: list[tuple[float, float]],
    north_m: float,
    way: Way,
    place: tuple[float, float],
) -> None:
    found = chosen(rtl_type, garden=garden, rally=rally, north_m=north_m)
    assert found == (way, pytest.approx(place, abs=0.1))


def test_home_counts_for_a_vtol_that_hovers_with_type_1_too() -> None:
    assert chosen(1, garden=True, north_m=10.0, airframe="vtol")[1] == HOME


def test_on_its_wing_it_does_not() -> None:
    air = Airborne("vtol", (10.0, 0.0, 20.0), RTL_TYPE=1)
    air.upload([takeoff(10), land(*GARDEN)])
    plan = ReturnDestination(air.context, air.store, air.result).choose()
    assert (plan.way, plan.point) == (Way.TO_LANDING, pytest.approx(GARDEN, abs=0.1))


@pytest.mark.parametrize(("garden", "way"), [(True, Way.FORWARD), (False, Way.REVERSE)])
def test_type_2_follows_the_mission_to_its_landing_and_without_one_back(garden: bool, way: Way) -> None:
    assert chosen(2, garden=garden, rally=[RALLY], north_m=20.0)[0] is way


@pytest.mark.parametrize(
    ("seq", "marker", "way"),
    [
        (1, False, Way.REVERSE),
        (2, False, Way.FORWARD),  # one item on, two back
        (3, False, Way.FORWARD),
        (4, True, Way.FORWARD),
        (1, True, Way.REVERSE),
    ],
)
def test_type_4_counts_the_items_to_both(seq: int, marker: bool, way: Way) -> None:
    assert chosen(4, garden=True, north_m=20.0, seq=seq, marker=marker)[0] is way
    assert chosen(4, garden=False, north_m=20.0, seq=seq)[0] is Way.REVERSE


def test_as_many_items_on_as_back_is_back() -> None:
    gcs = GroundStation(params={"RTL_TYPE": 4})
    gcs.upload([takeoff(10), waypoint(20, 0, 10), waypoint(40, 0, 10), waypoint(50, 0, 10), land(*GARDEN)])
    gcs.fly(0.1)
    vehicle = gcs.vehicle
    vehicle.store.current_seq = 2
    assert ReturnDestination(vehicle.context, vehicle.store, vehicle.mission.result).choose().way is Way.REVERSE


@pytest.mark.parametrize("rtl_type", [1, 2, 3, 4])
def test_a_mission_that_cannot_be_flown_counts_for_nothing(rtl_type: int) -> None:
    gcs = GroundStation(params={"RTL_TYPE": rtl_type})
    gcs.upload([waypoint(20, 0, 10), takeoff(10), land(*GARDEN)])
    gcs.fly(0.1)
    vehicle = gcs.vehicle
    vehicle.state.body.north_m = 50.0
    plan = ReturnDestination(vehicle.context, vehicle.store, vehicle.mission.result).choose()
    assert (plan.way, plan.point) == (Way.DIRECT, HOME)


def test_a_return_flies_and_lands_there() -> None:
    gcs = GroundStation(params={"RTL_TYPE": 1, "RTL_RETURN_ALT": 12.0, "NAV_ACC_RAD": 2.0})
    gcs.start([takeoff(10), waypoint(20, 0, 10, 60, 1), land(*GARDEN)])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 10)
    gcs.command(Cmd.NAV_RETURN_TO_LAUNCH)
    gcs.until(lambda: not gcs.armed)
    assert gcs.distance_to(*GARDEN) < 1.0
