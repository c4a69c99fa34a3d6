"""The way of a return round a fence: it keeps to what is allowed, and is no longer than it has to be."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Polygon, box, union_all

from app.domain.airspace.geofence import FenceArea, length_m, way_round

HOME = (0.0, 0.0)
AREA = box(-50, -50, 250, 250)
PLACES = st.tuples(st.floats(-30, 230), st.floats(-30, 230))
BOXES = st.tuples(st.floats(20, 180), st.floats(20, 180), st.floats(5, 60), st.floats(5, 60))


def fence(*exclusions: Polygon, inside: Polygon | None = AREA) -> FenceArea:
    return FenceArea(inside, union_all(exclusions) if exclusions else None)


def test_without_anything_between_it_is_straight() -> None:
    assert way_round(fence(), (200.0, 100.0), HOME, 10.0) == ((200.0, 100.0), HOME)


def test_round_a_square_it_is_the_shorter_side_with_the_margin() -> None:
    way = way_round(fence(box(80, -10, 120, 60)), (200.0, 0.0), HOME, 10.0)
    assert way is not None
    assert {(round(x), round(y)) for x, y in way[1:-1]} == {(130, -20), (70, -20)}
    assert length_m(way) == pytest.approx(60.0 + 2 * math.hypot(70, 20), abs=3.0)


def test_a_gap_that_is_narrower_than_the_margins_is_no_way() -> None:
    wall = (box(90, -50, 110, 95), box(90, 105, 110, 250))
    assert way_round(fence(*wall), (200.0, 100.0), HOME, 10.0) is None
    assert way_round(fence(*wall), (200.0, 100.0), HOME, 3.0) is not None


def test_a_place_too_near_to_the_fence_has_no_way_and_a_start_there_leaves_it_first() -> None:
    square = box(80, -10, 120, 60)
    assert way_round(fence(square), HOME, (125.0, 0.0), 10.0) is None
    way = way_round(fence(square), (125.0, 0.0), HOME, 10.0)
    assert way is not None
    assert way[1] == pytest.approx((130.0, 0.0), abs=0.1)


@given(st.lists(BOXES, max_size=4), PLACES, PLACES, st.sampled_from([2.0, 4.0, 20.0]))
def test_a_way_stays_where_the_fence_allows_it_and_is_no_shorter_than_the_straight_one(
    boxes: list[tuple[float, float, float, float]],
    here: tuple[float, float],
    there: tuple[float, float],
    margin_m: float,
) -> None:
    area = fence(*(box(x, y, x + width, y + height) for x, y, width, height in boxes))
    way = way_round(area, here, there, margin_m)
    if way is None:
        return
    assert (way[0], way[-1]) == (here, there)
    assert length_m(way) >= math.dist(here, there) - 0.1
    assert all(area.allows(LineString(leg)) for leg in pairwise(way) if leg[0] != leg[1])
