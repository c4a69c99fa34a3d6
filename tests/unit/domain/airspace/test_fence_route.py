"""The way of a return round a fence: it keeps to what is allowed, and is no longer than it has to be."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, box, union_all

from app.domain.airspace.fence_route import FenceRoutes, NoWay, Way, length_m
from app.domain.airspace.geofence import FenceArea

HOME = (0.0, 0.0)
AREA = box(-50, -50, 250, 250)
PLACES = st.tuples(st.floats(-30, 230), st.floats(-30, 230))
BOXES = st.tuples(st.floats(20, 180), st.floats(20, 180), st.floats(5, 60), st.floats(5, 60))


def fence(*exclusions: Polygon, inside: Polygon | None = AREA) -> FenceArea:
    return FenceArea(inside, union_all(exclusions) if exclusions else None)


def way_round(area: FenceArea, here: tuple[float, float], there: tuple[float, float], margin_m: float) -> Way | NoWay:
    return FenceRoutes(area, margin_m).way(here, there)


def test_without_anything_between_it_is_straight() -> None:
    assert way_round(fence(), (200.0, 100.0), HOME, 10.0) == ((200.0, 100.0), HOME)


def test_round_a_square_it_is_the_shorter_side_with_the_margin() -> None:
    way = way_round(fence(box(80, -10, 120, 60)), (200.0, 0.0), HOME, 10.0)
    assert not isinstance(way, NoWay)
    assert {(round(x), round(y)) for x, y in way[1:-1]} == {(130, -20), (70, -20)}
    assert length_m(way) == pytest.approx(60.0 + 2 * math.hypot(70, 20), abs=3.0)


def test_a_gap_that_is_narrower_than_the_margins_is_no_way() -> None:
    wall = (box(90, -50, 110, 95), box(90, 105, 110, 250))
    assert way_round(fence(*wall), (200.0, 100.0), HOME, 10.0) is NoWay.BLOCKED
    assert way_round(fence(*wall), (200.0, 100.0), HOME, 3.0) is not NoWay.BLOCKED


def test_a_place_too_near_to_the_fence_has_no_way_and_a_start_there_leaves_it_first() -> None:
    square = box(80, -10, 120, 60)
    assert way_round(fence(square), HOME, (125.0, 0.0), 10.0) is NoWay.BLOCKED
    way = way_round(fence(square), (125.0, 0.0), HOME, 10.0)
    assert not isinstance(way, NoWay)
    assert way[1] == pytest.approx((130.0, 0.0), abs=0.1)


def test_a_fence_of_more_corners_than_a_vehicle_stores_is_not_searched() -> None:
    rings = [Point(70.0 * (n % 9), 70.0 * (n // 9)).buffer(30.0, quad_segs=8) for n in range(81)]
    assert way_round(fence(*rings, inside=None), (-60.0, -50.0), (690.0, 650.0), 2.0) is NoWay.UNKNOWN


def test_the_ways_around_one_fence_share_a_bound_of_work() -> None:
    pillars = fence(*(box(40 * n, 40 * e, 40 * n + 10, 40 * e + 10) for n in range(9) for e in range(9)), inside=None)
    routes = FenceRoutes(pillars, 4.0)
    ends = [((-20.0, 5.0 + 40 * n), (380.0, 325.0 - 40 * e)) for n in range(9) for e in range(9)]
    ways = [routes.way(here, there) for here, there in ends]
    assert not isinstance(ways[0], NoWay)
    assert ways[-1] is NoWay.UNKNOWN
    assert routes.way(*ends[0]) == ways[0], "what was found once is known"


def test_a_destination_that_is_walled_in_is_found_to_be_so_without_a_search() -> None:
    walled = box(-40, -40, 40, 40).difference(box(-30, -30, 30, 30))
    pillars = [box(60 * n, 60, 60 * n + 10, 70) for n in range(80)]
    routes = FenceRoutes(fence(walled, *pillars, inside=None), 4.0)
    assert {routes.way((60.0 * n, 200.0), HOME) for n in range(80)} == {NoWay.BLOCKED}


@given(st.lists(BOXES, max_size=4), PLACES, PLACES, st.sampled_from([2.0, 4.0, 20.0]))
def test_a_way_stays_where_the_fence_allows_it_and_is_no_shorter_than_the_straight_one(
    boxes: list[tuple[float, float, float, float]],
    here: tuple[float, float],
    there: tuple[float, float],
    margin_m: float,
) -> None:
    area = fence(*(box(x, y, x + width, y + height) for x, y, width, height in boxes))
    way = way_round(area, here, there, margin_m)
    if isinstance(way, NoWay):
        return
    assert (way[0], way[-1]) == (here, there)
    assert length_m(way) >= math.dist(here, there) - 0.1
    assert all(area.allows(LineString(leg)) for leg in pairwise(way) if leg[0] != leg[1])
