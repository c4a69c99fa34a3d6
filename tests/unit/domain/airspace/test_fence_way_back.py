"""From outside of a fence: which straight ways lead back in."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, box, union_all

from app.domain.airspace.geofence import FenceArea

SQUARE = box(-50, -50, 50, 50)
BOXES = st.tuples(st.floats(-60, 40), st.floats(-60, 40), st.floats(5, 60), st.floats(5, 60))
PLACES = st.tuples(st.floats(-90, 90), st.floats(-90, 90))


@pytest.mark.parametrize(
    ("start", "end", "leads"),
    [
        ((51.0, 0.0), (45.0, 0.0), True),
        ((90.0, 0.0), (80.0, 0.0), True),
        ((51.0, 0.0), (57.0, 0.0), False),
        ((51.0, 0.0), (51.0, 20.0), False),
        ((60.0, 0.0), (-55.0, 0.0), False),
        ((0.0, 0.0), (20.0, 0.0), False),
    ],
    ids=["back in", "nearer", "farther out", "beside it", "in and out again", "it was never outside"],
)
def test_a_way_back_ends_inside_or_nearer(start: tuple[float, float], end: tuple[float, float], leads: bool) -> None:
    assert FenceArea(SQUARE, None).leads_back(start, end) is leads


def test_out_of_an_exclusion_the_way_may_not_lead_deeper_into_it() -> None:
    for fence in (FenceArea(None, SQUARE), FenceArea(box(-500, -500, 500, 500), SQUARE)):
        assert fence.leads_back((40.0, 0.0), (60.0, 0.0))
        assert fence.leads_back((40.0, 0.0), (45.0, 0.0))
        assert not fence.leads_back((40.0, 0.0), (-60.0, 0.0))


def test_a_way_back_does_not_lead_through_an_exclusion() -> None:
    assert FenceArea(SQUARE, None).leads_back((60.0, 0.0), (-40.0, 0.0))
    assert not FenceArea(SQUARE, box(-10, -10, 10, 10)).leads_back((60.0, 0.0), (-40.0, 0.0))


def test_a_way_back_across_a_bay_leads_farther_out_in_its_middle() -> None:
    bay = Polygon([(-50, 0), (-45, 0), (-45, 90), (45, 90), (45, 0), (50, 0), (50, 95), (-50, 95)])
    assert FenceArea(bay, None).leads_back((-44.0, 20.0), (-46.0, 20.0))
    assert not FenceArea(bay, None).leads_back((-44.0, 20.0), (46.0, 20.0))


@settings(deadline=None)
@given(st.lists(BOXES, max_size=3), st.booleans(), PLACES, PLACES)
def test_on_a_way_back_it_is_never_farther_outside_and_once_inside_it_stays(
    boxes: list[tuple[float, float, float, float]],
    has_inclusion: bool,
    start: tuple[float, float],
    end: tuple[float, float],
) -> None:
    holes = union_all([box(x, y, x + width, y + height) for x, y, width, height in boxes]) if boxes else None
    fence = FenceArea(SQUARE if has_inclusion else None, holes)
    if not fence.leads_back(start, end):
        return
    free = (SQUARE if has_inclusion else box(-900, -900, 900, 900)).difference(holes if holes else Polygon())
    shares = [step / 60 for step in range(61)]
    way = [Point(start[0] + (end[0] - start[0]) * s, start[1] + (end[1] - start[1]) * s) for s in shares]
    out_m = [free.distance(place) for place in way]
    assert max(out_m) <= out_m[0] * 1.01 + 0.06
    assert out_m[-1] < out_m[0] or out_m[-1] == 0.0
    entered = next((number for number, one in enumerate(out_m) if one == 0.0), len(out_m))
    assert max(out_m[entered:], default=0.0) <= 1e-6
